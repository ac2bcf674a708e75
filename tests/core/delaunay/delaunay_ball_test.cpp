#include "core/delaunay/delaunay_ball.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/delaunay/predicates.h"

namespace shapedb {
namespace {

DelaunayBall ballThrough(const Site& p, const Site& a, const Site& b, const Site& c) {
    const std::array<Way, 3> ways = {wayTo(p, a), wayTo(p, b), wayTo(p, c)};
    const std::array<const Way*, 3> three = {&ways[0], &ways[1], &ways[2]};
    DelaunayBall ball;
    DelaunayBall again;
    ballsThrough(p, {three, three}, ball, again);
    return ball;
}

// 1: surely. -1: surely not. 0: unknown.
int holds(const DelaunayBall& ball, const Site& p) {
    const Held held = ballsHold(ball, ball, p);
    EXPECT_EQ(held.surely & held.unknown, 0U);
    return held.surely != 0 ? 1 : held.unknown != 0 ? 0 : -1;
}

struct Tally {
    int judged = 0;
    int open = 0;
    int wrong = 0;
};

// The ball of four sites against the exact predicate.
void judge(const Site& p, const Site& a, const Site& b, const Site& c, const Site& query, Tally& tally) {
    const int sense = orientation(p, a, b, c);
    if (sense == 0) return;
    const DelaunayBall ball = ballThrough(p, a, b, c);
    const int quick = holds(ball, query);
    const int exact = sense > 0 ? exactSideOfSphere(p, a, b, c, query) : exactSideOfSphere(p, b, a, c, query);
    ++tally.judged;
    tally.open += quick == 0 ? 1 : 0;
    tally.wrong += quick != 0 && quick != exact ? 1 : 0;
}

Site siteNear(Random& random, const Site& centre, double reach) {
    const auto at = [&](double v) { return v + reach * (2.0 * random.uniform() - 1.0); };
    return {at(centre.x), at(centre.y), at(centre.z)};
}

TEST(DelaunayBall, IsNeverSureOfWhatIsNotSo) {
    Random random(7);
    for (const double reach : {1.0, 1e-3, 1e-7}) {
        Tally tally;
        for (int i = 0; i < 20000; ++i) {
            const Site centre = siteNear(random, {}, 1.0);
            const auto near = [&] { return siteNear(random, centre, reach); };
            judge(near(), near(), near(), near(), near(), tally);
        }
        EXPECT_EQ(tally.wrong, 0) << reach;
        EXPECT_GT(tally.judged, 19000) << reach;
        // It is of use.
        EXPECT_LT(tally.open, reach < 1e-6 ? tally.judged + 1 : tally.judged / 50) << reach;
    }
}

// The query all but on the sphere, or the corners all but in a plane.
TEST(DelaunayBall, IsNotSureWhenItIsClose) {
    Random random(11);
    Tally cospherical;
    Tally flat;
    for (int i = 0; i < 20000; ++i) {
        const auto onSphere = [&] {
            const Site s = siteNear(random, {}, 1.0);
            const double length = std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
            return Site{s.x / length, s.y / length, s.z / length};
        };
        judge(onSphere(), onSphere(), onSphere(), onSphere(), onSphere(), cospherical);
        const auto onPlane = [&] {
            Site s = siteNear(random, {}, 1.0);
            s.z = std::ldexp(random.uniform(), -static_cast<int>(random.below(60)));
            return s;
        };
        judge(onPlane(), onPlane(), onPlane(), onPlane(), onPlane(), flat);
    }
    EXPECT_EQ(cospherical.wrong, 0);
    EXPECT_EQ(cospherical.open, cospherical.judged);
    EXPECT_EQ(flat.wrong, 0);
    EXPECT_GT(flat.open, 0);
    EXPECT_LT(flat.open, flat.judged);
}

TEST(DelaunayBall, SaysNothingWhereDoublesEnd) {
    for (const double scale : {1e-80, 1e-60, 1e60, 1e100}) {
        const auto at = [=](double x, double y, double z) { return Site{scale * x, scale * y, scale * z}; };
        Tally tally;
        judge(at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1), at(0.5, 0.5, 0.25), tally);
        judge(at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1), at(3, 0.5, 0.25), tally);
        EXPECT_EQ(tally.wrong, 0) << scale;
    }
    DelaunayBall none{0.0, 0.0, 0.0, kNoBall};
    EXPECT_EQ(holds(none, {1.0, 2.0, 3.0}), 0);
}

// Two together as each with itself, in either place.
TEST(DelaunayBall, OfTwoAreThoseOfEach) {
    Random random(3);
    for (int i = 0; i < 2000; ++i) {
        const Site p = siteNear(random, {}, 1.0);
        std::vector<Site> ends;
        for (int k = 0; k < 6; ++k) ends.push_back(siteNear(random, p, i % 3 == 0 ? 1e-6 : 1.0));
        if (i % 5 == 0)
            ends[5] = {2.0 * ends[3].x - p.x, 2.0 * ends[3].y - p.y, 2.0 * ends[3].z - p.z};  // flat
        std::vector<Way> ways;
        for (const Site& end : ends) ways.push_back(wayTo(p, end));
        const std::array<DelaunayBall, 2> each = {ballThrough(p, ends[0], ends[1], ends[2]),
                                                  ballThrough(p, ends[3], ends[4], ends[5])};
        std::array<DelaunayBall, 2> both;
        ballsThrough(p, {{&ways[0], &ways[1], &ways[2]}, {&ways[3], &ways[4], &ways[5]}}, both[0], both[1]);
        const Site query = siteNear(random, p, 1.0);
        const Held held = ballsHold(each[0], each[1], query);
        for (std::size_t k = 0; k < 2; ++k) {
            ASSERT_EQ(std::isnan(both[k].squaredRadius), std::isnan(each[k].squaredRadius)) << i;
            const int expected = holds(each[k], query);
            ASSERT_EQ((held.surely >> k & 1u) != 0, expected > 0) << i;
            ASSERT_EQ((held.unknown >> k & 1u) != 0, expected == 0) << i;
            if (std::isnan(each[k].squaredRadius)) continue;
            ASSERT_EQ(both[k].squaredRadius, each[k].squaredRadius) << i;
            ASSERT_EQ(both[k].x, each[k].x) << i;
            ASSERT_EQ(both[k].y, each[k].y) << i;
            ASSERT_EQ(both[k].z, each[k].z) << i;
        }
    }
}

}  // namespace
}  // namespace shapedb
