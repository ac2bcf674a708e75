#include "core/segmentation/delaunay_ball.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/segmentation/predicates.h"

namespace shapedb {
namespace {

struct Tally {
    int judged = 0;
    int open = 0;
    int wrong = 0;
};

// The ball of four sites against the exact predicate.
void judge(const Site& p, const Site& a, const Site& b, const Site& c, const Site& query, Tally& tally) {
    const int sense = orientation(p, a, b, c);
    if (sense == 0) return;
    const DelaunayBall ball = ballThrough(p, wayTo(p, a), wayTo(p, b), wayTo(p, c));
    const int quick = ballHolds(ball, query);
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
    EXPECT_EQ(ballHolds(none, {1.0, 2.0, 3.0}), 0);
}

}  // namespace
}  // namespace shapedb
