// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/contacts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/segmentation/flow.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

// Random labels, with a sixth of the tetrahedra outside.
std::vector<std::int32_t> randomLabels(std::size_t count, Random& random) {
    std::vector<std::int32_t> labels(count);
    for (auto& label : labels) label = static_cast<std::int32_t>(random.uniform() * 6.0) - 1;
    return labels;
}

double nearestOnSegment(const Point3& a, const Point3& b, const Point3& to) {
    const Point3 d = b - a;
    const double whole = dot(d, d);
    const double at = whole > 0.0 ? std::clamp(dot(to - a, d) / whole, 0.0, 1.0) : 0.0;
    return distance(a + at * d, to);
}

// A Voronoi edge has the same distance from all three corners of its facet, so its smallest ball is where it
// comes nearest to one of them.
TEST(SegmentContacts, HaveTheWidestPassageAndAllSharedArea) {
    Random random(5);
    std::size_t pairs = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& flat = cloud.tetrahedra;
        const auto labels = randomLabels(flat.size(), random);
        std::map<std::pair<std::int32_t, std::int32_t>, std::pair<double, double>> expected;
        for (std::size_t t = 0; t < flat.size(); ++t) {
            for (std::size_t facet = 0; facet < 4; ++facet) {
                const std::uint32_t next = flat.neighbours[t][facet];
                if (next == kNoTetrahedron || labels[t] < 0 || labels[next] <= labels[t]) continue;
                const auto c = cornersOf(cloud, t);
                const Point3 corner = c[(facet + 1) % 4];
                auto& [widest, area] = expected[{labels[t], labels[next]}];
                widest = std::max(widest,
                                  nearestOnSegment(flat.circumcentres[t], flat.circumcentres[next], corner));
                area += 0.5 * length(cross(c[(facet + 2) % 4] - corner, c[(facet + 3) % 4] - corner));
            }
        }
        const std::vector<std::uint8_t> all(flat.size(), 1);
        const auto flow = flowMasks(cloud.points, flat, all).value();
        const auto contacts = segmentContacts(cloud.points, flat, flow, labels).value();
        ASSERT_EQ(contacts.size(), expected.size()) << cloud.name;
        auto at = expected.begin();
        for (const SegmentContact& contact : contacts) {
            EXPECT_EQ(contact.first, static_cast<std::uint32_t>(at->first.first)) << cloud.name;
            EXPECT_EQ(contact.second, static_cast<std::uint32_t>(at->first.second)) << cloud.name;
            EXPECT_NEAR(contact.saddleRadius, at->second.first, 1e-6 * at->second.first) << cloud.name;
            EXPECT_NEAR(contact.area, at->second.second, 1e-12 * at->second.second) << cloud.name;
            ++at;
            ++pairs;
        }
    }
    EXPECT_GT(pairs, 50U);
}

TEST(SegmentContacts, CanBeCancelled) {
    const Triangulated& cloud = triangulatedClouds().front();
    const std::vector<std::uint8_t> flow(cloud.tetrahedra.size(), 0);
    const std::vector<std::int32_t> labels(cloud.tetrahedra.size(), 0);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto contacts = segmentContacts(cloud.points, cloud.tetrahedra, flow, labels, context);
    ASSERT_FALSE(contacts);
    EXPECT_EQ(contacts.error().code, ErrorCode::kCancelled);
}

// Between the balls of a dumbbell and its rod the saddle is as wide as the rod.
TEST(SegmentContacts, AreTheEndsOfADumbbellsRod) {
    SegmentationOptions options;
    options.mergeContrast = 1.3;
    const Segmentation s = segment(sampleBoundary(makeDumbbell().solid, 6000, 3).value(), options).value();
    ASSERT_EQ(s.segments.size(), 3U);
    std::vector<std::uint8_t> inside(s.tetrahedra.size());
    for (std::size_t t = 0; t < inside.size(); ++t) inside[t] = s.tetrahedronSegment[t] >= 0 ? 1 : 0;
    const auto flow = flowMasks(s.sites, s.tetrahedra, inside).value();
    const auto contacts = segmentContacts(s.sites, s.tetrahedra, flow, s.tetrahedronSegment).value();
    ASSERT_EQ(contacts.size(), 2U);
    for (std::uint32_t ball = 0; ball < 2; ++ball) {
        EXPECT_EQ(contacts[ball].first, ball);
        EXPECT_EQ(contacts[ball].second, 2U);
        EXPECT_NEAR(contacts[ball].saddleRadius, 0.3, 0.15 * 0.3);
        const double section = kPi * 0.3 * 0.3;
        EXPECT_GT(contacts[ball].area, 0.7 * section);
        EXPECT_LT(contacts[ball].area, 4.0 * section);
    }
}

}  // namespace
}  // namespace shapedb
