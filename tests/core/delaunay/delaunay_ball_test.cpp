// SPDX-License-Identifier: GPL-3.0-or-later
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
    const std::array<Offset, 3> offsets = {offsetTo(p, a), offsetTo(p, b), offsetTo(p, c)};
    const std::array<const Offset*, 3> three = {&offsets[0], &offsets[1], &offsets[2]};
    DelaunayBall ball;
    DelaunayBall again;
    ballsThrough(p, {three, three}, ball, again);
    return ball;
}

// 1: inside. -1: outside. 0: unknown.
int quickAnswer(const DelaunayBall& ball, const Site& p) {
    const Containment contains = ballsContain(ball, ball, p);
    EXPECT_EQ(contains.inside & contains.unknown, 0U);
    return contains.inside != 0 ? 1 : contains.unknown != 0 ? 0 : -1;
}

struct Tally {
    int compared = 0;
    int unknown = 0;
    int wrong = 0;
};

// Compares the ball of four sites with the exact predicate.
void compare(const Site& p, const Site& a, const Site& b, const Site& c, const Site& query, Tally& tally) {
    const int sense = orientation(p, a, b, c);
    if (sense == 0) return;
    const int quick = quickAnswer(ballThrough(p, a, b, c), query);
    const int exact = sense > 0 ? exactSideOfSphere(p, a, b, c, query) : exactSideOfSphere(p, b, a, c, query);
    ++tally.compared;
    tally.unknown += quick == 0 ? 1 : 0;
    tally.wrong += quick != 0 && quick != exact ? 1 : 0;
}

Site siteNear(Random& random, const Site& centre, double reach) {
    const auto at = [&](double v) { return v + reach * (2.0 * random.uniform() - 1.0); };
    return {at(centre.x), at(centre.y), at(centre.z)};
}

// On the sphere around a centre, up to rounding.
Site siteOnSphere(Random& random, const Site& centre, double radius) {
    const Site s = siteNear(random, {}, 1.0);
    const double scale = radius / std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
    return {centre.x + scale * s.x, centre.y + scale * s.y, centre.z + scale * s.z};
}

TEST(DelaunayBall, AnswersMostRandomQueriesAndNeverWrongly) {
    Random random(7);
    for (const double reach : {1.0, 1e-3}) {
        Tally tally;
        for (int i = 0; i < 20000; ++i) {
            const Site centre = siteNear(random, {}, 1.0);
            const auto near = [&] { return siteNear(random, centre, reach); };
            compare(near(), near(), near(), near(), near(), tally);
        }
        EXPECT_EQ(tally.wrong, 0) << reach;
        EXPECT_GT(tally.compared, 19000) << reach;
        EXPECT_LT(tally.unknown, tally.compared / 50) << reach;
    }
}

// So far from the origin that the centre cannot be rounded well enough.
TEST(DelaunayBall, IsRefusedWhenItIsTinyAndFarFromTheOrigin) {
    Random random(7);
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        const Site centre{0.3 + 0.7 * random.uniform(), random.uniform(), random.uniform()};
        const double radius = i % 2 == 0 ? 1e-7 : 1e-5;
        const auto corner = [&] { return siteOnSphere(random, centre, radius); };
        const bool isRefused = std::isnan(ballThrough(corner(), corner(), corner(), corner()).squaredRadius);
        if (i % 2 == 0) {
            EXPECT_TRUE(isRefused) << i;
        } else {
            refused += isRefused ? 1 : 0;
        }
    }
    EXPECT_LT(refused, 50);
}

// Queries at relative distances from the sphere around the margin, balls as flat and as far from the origin
// as is allowed: with a much smaller margin some answers are wrong.
TEST(DelaunayBall, MarginCoversRoundingOfFlatAndDistantBalls) {
    Random random(13);
    Tally nearby;
    Tally beyond;
    for (int i = 0; i < 60000; ++i) {
        // Corners near a great circle, within `height` of its plane.
        const double height = std::pow(10.0, -8.0 * random.uniform());
        const double radius = std::pow(10.0, -6.0 * random.uniform());
        const Site centre = siteNear(random, {}, 1.0);
        const auto corner = [&] {
            Site s = siteNear(random, {}, 1.0);
            s.z *= height;
            const double scale = radius / std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
            return Site{centre.x + scale * s.x, centre.y + scale * s.y, centre.z + scale * s.z};
        };
        const Site p = corner(), a = corner(), b = corner(), c = corner();
        const DelaunayBall ball = ballThrough(p, a, b, c);
        if (std::isnan(ball.squaredRadius)) continue;
        const double away = std::pow(10.0, -12.0 + 6.0 * random.uniform()) * (i % 2 == 0 ? 1.0 : -1.0);
        const Site ballCentre{ball.x, ball.y, ball.z};
        const Site query = siteOnSphere(random, ballCentre, (1.0 + away) * std::sqrt(ball.squaredRadius));
        compare(p, a, b, c, query, std::abs(away) > 2.0 * kBallMargin ? beyond : nearby);
    }
    EXPECT_GT(nearby.compared, 10000);
    EXPECT_EQ(nearby.wrong, 0);
    EXPECT_GT(nearby.unknown, nearby.compared / 2);
    EXPECT_GT(beyond.compared, 5000);
    EXPECT_EQ(beyond.wrong, 0);
    EXPECT_EQ(beyond.unknown, 0) << "the margin is wider than it says";
}

TEST(DelaunayBall, LeavesCosphericalAndFlatPointsToThePredicates) {
    Random random(11);
    Tally cospherical;
    Tally flat;
    for (int i = 0; i < 20000; ++i) {
        const auto onSphere = [&] { return siteOnSphere(random, {}, 1.0); };
        compare(onSphere(), onSphere(), onSphere(), onSphere(), onSphere(), cospherical);
        const auto nearPlane = [&] {
            Site s = siteNear(random, {}, 1.0);
            s.z = std::ldexp(random.uniform(), -static_cast<int>(random.below(60)));
            return s;
        };
        compare(nearPlane(), nearPlane(), nearPlane(), nearPlane(), nearPlane(), flat);
    }
    EXPECT_EQ(cospherical.wrong, 0);
    EXPECT_EQ(cospherical.unknown, cospherical.compared);
    EXPECT_EQ(flat.wrong, 0);
    EXPECT_GT(flat.unknown, 0);
    EXPECT_LT(flat.unknown, flat.compared);
}

TEST(DelaunayBall, IsNeverWrongWhereProductsUnderflowOrOverflow) {
    for (const double scale : {1e-80, 1e-60, 1e60, 1e100}) {
        const auto at = [=](double x, double y, double z) { return Site{scale * x, scale * y, scale * z}; };
        Tally tally;
        compare(at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1), at(0.5, 0.5, 0.25), tally);
        compare(at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1), at(3, 0.5, 0.25), tally);
        EXPECT_EQ(tally.wrong, 0) << scale;
    }
    const DelaunayBall none{0.0, 0.0, 0.0, kNoBall};
    EXPECT_EQ(quickAnswer(none, {1.0, 2.0, 3.0}), 0);
}

TEST(DelaunayBall, PairsGiveTheSameBitsAsSingleBalls) {
    Random random(3);
    for (int i = 0; i < 2000; ++i) {
        const Site p = siteNear(random, {}, 1.0);
        std::vector<Site> ends;
        for (int k = 0; k < 6; ++k) ends.push_back(siteNear(random, p, i % 3 == 0 ? 1e-6 : 1.0));
        if (i % 5 == 0)
            ends[5] = {2.0 * ends[3].x - p.x, 2.0 * ends[3].y - p.y, 2.0 * ends[3].z - p.z};  // flat
        std::vector<Offset> offsets;
        for (const Site& end : ends) offsets.push_back(offsetTo(p, end));
        const std::array<DelaunayBall, 2> each = {ballThrough(p, ends[0], ends[1], ends[2]),
                                                  ballThrough(p, ends[3], ends[4], ends[5])};
        std::array<DelaunayBall, 2> both;
        ballsThrough(p, {{&offsets[0], &offsets[1], &offsets[2]}, {&offsets[3], &offsets[4], &offsets[5]}},
                     both[0], both[1]);
        const Site query = siteNear(random, p, 1.0);
        const Containment contains = ballsContain(each[0], each[1], query);
        for (std::size_t k = 0; k < 2; ++k) {
            ASSERT_EQ(std::isnan(both[k].squaredRadius), std::isnan(each[k].squaredRadius)) << i;
            const int expected = quickAnswer(each[k], query);
            ASSERT_EQ((contains.inside >> k & 1u) != 0, expected > 0) << i;
            ASSERT_EQ((contains.unknown >> k & 1u) != 0, expected == 0) << i;
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
