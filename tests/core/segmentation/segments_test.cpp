// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/segments.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/flow.h"
#include "core/segmentation/interior.h"
#include "tests/core/segmentation/exact_balls.h"

namespace shapedb {
namespace {

// A cloud with an interior: the one of the method, or a random one, in which many tetrahedra flow to no
// maximum.
struct Case {
    const Triangulated* cloud;
    std::vector<std::uint8_t> interior;
    std::vector<std::uint8_t> flow;
    SegmentLabels fine;

    const Tetrahedra& flat() const { return cloud->tetrahedra; }

    void forEachSuccessor(std::uint32_t t, const std::function<void(std::uint32_t)>& visit) const {
        for (std::size_t i = 0; i < 4; ++i) {
            const std::uint32_t next = flat().neighbours[t][i];
            if (((flow[t] >> i) & 1) != 0 && next != kNoTetrahedron && interior[next]) visit(next);
        }
    }
};

const std::vector<Case>& cases() {
    static const std::vector<Case> all = [] {
        std::vector<Case> made;
        Random random(17);
        const auto add = [&](const Triangulated& cloud, std::vector<std::uint8_t> interior) {
            Case c{&cloud, std::move(interior), {}, {}};
            c.flow = flowMasks(cloud.points, cloud.tetrahedra, c.interior).value();
            c.fine = stableManifolds(cloud.tetrahedra, c.interior, c.flow).value();
            made.push_back(std::move(c));
        };
        for (const Triangulated& cloud : triangulatedClouds()) {
            const auto spacings = localSpacings(cloud.points).value();
            add(cloud, interiorTetrahedra(cloud.points, cloud.tetrahedra,
                                          bigBalls(cloud.tetrahedra, spacings, 0.5), SegmentationOptions{})
                           .value());
            for (const double share : {0.3, 0.8, 1.0}) {
                std::vector<std::uint8_t> flags(cloud.tetrahedra.size());
                for (auto& flag : flags) flag = random.uniform() < share;
                add(cloud, flags);
            }
        }
        return made;
    }();
    return all;
}

// Strength of every tetrahedron as the paper defines it, by recursion: the largest circumradius
// among the maxima it flows into; -1 when it flows into none.
std::vector<double> strengths(const Case& c) {
    std::vector<double> known(c.flat().size(), std::numeric_limits<double>::quiet_NaN());
    const std::function<double(std::uint32_t)> strength = [&](std::uint32_t t) {
        if (!std::isnan(known[t])) return known[t];
        double value = c.flow[t] == 0 ? c.flat().circumradii[t] : -1.0;
        c.forEachSuccessor(t, [&](std::uint32_t next) { value = std::max(value, strength(next)); });
        return known[t] = value;
    };
    for (std::uint32_t t = 0; t < c.flat().size(); ++t) {
        if (c.interior[t]) strength(t);
    }
    return known;
}

double maximumRadius(const Case& c, std::int32_t segment) {
    return c.flat().circumradii[c.fine.maxima[static_cast<std::size_t>(segment)]];
}

TEST(StableManifolds, PartitionTheInterior) {
    for (const Case& c : cases()) {
        ASSERT_EQ(c.fine.ofTetrahedron.size(), c.flat().size());
        std::set<std::int32_t> used;
        for (std::size_t t = 0; t < c.flat().size(); ++t) {
            const std::int32_t segment = c.fine.ofTetrahedron[t];
            ASSERT_EQ(segment >= 0, c.interior[t] != 0) << c.cloud->name;
            ASSERT_LT(segment, static_cast<std::int32_t>(c.fine.maxima.size()));
            if (segment >= 0) used.insert(segment);
        }
        EXPECT_EQ(used.size(), c.fine.maxima.size()) << "no segment is empty";
        for (std::size_t s = 0; s < c.fine.maxima.size(); ++s) {
            ASSERT_EQ(c.fine.ofTetrahedron[c.fine.maxima[s]], static_cast<std::int32_t>(s));
        }
    }
}

TEST(StableManifolds, BelongToTheStrongestMaximum) {
    std::size_t followed = 0;
    for (const Case& c : cases()) {
        const auto strength = strengths(c);
        for (std::uint32_t t = 0; t < c.flat().size(); ++t) {
            if (!c.interior[t] || strength[t] < 0.0) continue;
            const std::int32_t segment = c.fine.ofTetrahedron[t];
            ASSERT_EQ(maximumRadius(c, segment), strength[t]) << c.cloud->name;
            if (c.flow[t] == 0) {
                ASSERT_EQ(c.fine.maxima[static_cast<std::size_t>(segment)], t)
                    << "a maximum is its own maximum";
                continue;
            }
            // t goes where its strongest successor goes (one of them, when several are as strong).
            bool withStrongest = false;
            c.forEachSuccessor(t, [&](std::uint32_t next) {
                withStrongest =
                    withStrongest || (strength[next] == strength[t] && c.fine.ofTetrahedron[next] == segment);
            });
            ASSERT_TRUE(withStrongest) << c.cloud->name;
            ++followed;
        }
    }
    EXPECT_GT(followed, 10000U);
}

// Leftovers join the labelled neighbour with the largest ball, a whole layer at a time; those that no label
// reaches become islands. The reference goes over all tetrahedra in rounds.
TEST(StableManifolds, LeftoversJoinLayerByLayer) {
    std::size_t leftovers = 0;
    std::size_t islands = 0;
    for (const Case& c : cases()) {
        const auto strength = strengths(c);
        std::vector<std::int32_t> expected(c.flat().size(), -1);
        for (std::size_t t = 0; t < expected.size(); ++t) {
            if (c.interior[t] && strength[t] >= 0.0) expected[t] = c.fine.ofTetrahedron[t];
            leftovers += c.interior[t] && strength[t] < 0.0;
        }
        for (bool changed = true; changed;) {
            changed = false;
            auto next = expected;
            for (std::size_t t = 0; t < expected.size(); ++t) {
                if (!c.interior[t] || expected[t] >= 0) continue;
                double largest = -1.0;
                for (const std::uint32_t n : c.flat().neighbours[t]) {
                    if (n == kNoTetrahedron || expected[n] < 0 || c.flat().circumradii[n] <= largest)
                        continue;
                    largest = c.flat().circumradii[n];
                    next[t] = expected[n];
                    changed = true;
                }
            }
            expected = next;
        }
        for (std::size_t t = 0; t < expected.size(); ++t) {
            if (expected[t] >= 0) {
                ASSERT_EQ(c.fine.ofTetrahedron[t], expected[t]) << c.cloud->name;
            } else if (c.interior[t]) {
                // An island, around its largest ball, which flows into no maximum.
                const std::int32_t segment = c.fine.ofTetrahedron[t];
                ASSERT_LT(strength[c.fine.maxima[static_cast<std::size_t>(segment)]], 0.0);
                ASSERT_LE(c.flat().circumradii[t], maximumRadius(c, segment));
                ++islands;
            }
        }
    }
    EXPECT_GT(leftovers, 1000U) << "the random interiors must leave some";
    EXPECT_GT(islands, 10U);
}

TEST(StableManifolds, AreConnected) {
    for (const Case& c : cases()) {
        std::vector<std::uint8_t> seen(c.flat().size(), 0);
        std::size_t reached = 0;
        for (std::size_t s = 0; s < c.fine.maxima.size(); ++s) {
            std::vector<std::uint32_t> stack = {c.fine.maxima[s]};
            seen[stack.back()] = 1;
            while (!stack.empty()) {
                const std::uint32_t t = stack.back();
                stack.pop_back();
                ++reached;
                for (const std::uint32_t next : c.flat().neighbours[t]) {
                    if (next == kNoTetrahedron || seen[next]) continue;
                    if (c.fine.ofTetrahedron[next] != static_cast<std::int32_t>(s)) continue;
                    seen[next] = 1;
                    stack.push_back(next);
                }
            }
        }
        EXPECT_EQ(reached, static_cast<std::size_t>(std::count(c.interior.begin(), c.interior.end(), 1)))
            << c.cloud->name;
    }
}

TEST(StableManifolds, CanBeCancelled) {
    Random random(3);
    PointCloud points;
    for (int i = 0; i < 20000; ++i) points.push_back({random.uniform(), random.uniform(), random.uniform()});
    const auto flat = triangulate(points).value();
    const std::vector<std::uint8_t> all(flat.size(), 1);
    const auto flow = flowMasks(points, flat, all).value();
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto labels = stableManifolds(flat, all, flow, context);
    ASSERT_FALSE(labels);
    EXPECT_EQ(labels.error().code, ErrorCode::kCancelled);
}

TEST(CircumradiusOf, AgreesWithRationalArithmetic) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            const auto p = exactCorners(cloud, t);
            for (std::size_t i = 0; i < 4; ++i) {
                const double expected = std::sqrt(
                    CGAL::to_double(CGAL::squared_radius(p[(i + 1) % 4], p[(i + 2) % 4], p[(i + 3) % 4])));
                const double radius =
                    circumradiusOf(facetCorners(cloud.points, cloud.tetrahedra.vertices[t], i));
                // Needle triangles lose as many digits as the sine of the angle at a corner has zeros.
                const auto c = cornersOf(cloud, t);
                const Point3 u = c[(i + 2) % 4] - c[(i + 1) % 4];
                const Point3 v = c[(i + 3) % 4] - c[(i + 1) % 4];
                const double loss = length(u) * length(v) / length(cross(u, v));
                ASSERT_NEAR(radius, expected, 4e-15 * loss * expected) << cloud.name;
            }
        }
    }
}

// All pairs of segments that may merge, closed transitively over all triples.
TEST(MergeSegments, IsTheClosureOfMergeablePairs) {
    std::size_t mergedAway = 0;
    for (const Case& c : cases()) {
        for (const double ratio : {1.0, 1.5, 2.5}) {
            const std::size_t n = c.fine.maxima.size();
            std::map<std::pair<std::int32_t, std::int32_t>, double> widest;  // largest shared triangle
            for (std::size_t t = 0; t < c.flat().size(); ++t) {
                for (std::size_t i = 0; i < 4; ++i) {
                    const std::uint32_t next = c.flat().neighbours[t][i];
                    if (next == kNoTetrahedron || next < t) continue;
                    const auto [low, high] =
                        std::minmax({c.fine.ofTetrahedron[t], c.fine.ofTetrahedron[next]});
                    if (low < 0 || low == high) continue;
                    double& radius = widest[{low, high}];
                    radius = std::max(radius,
                                      circumradiusOf(facetCorners(c.cloud->points, c.flat().vertices[t], i)));
                }
            }
            std::vector<std::size_t> group(n);
            for (std::size_t s = 0; s < n; ++s) group[s] = s;
            for (bool changed = true; changed;) {
                changed = false;
                for (const auto& [pair, radius] : widest) {
                    const auto a = static_cast<std::size_t>(pair.first);
                    const auto b = static_cast<std::size_t>(pair.second);
                    if (maximumRadius(c, pair.first) > ratio * radius ||
                        maximumRadius(c, pair.second) > ratio * radius)
                        continue;
                    const std::size_t least = std::min(group[a], group[b]);
                    changed = changed || group[a] != least || group[b] != least;
                    group[a] = group[b] = least;
                }
            }
            const SegmentLabels merged = mergeSegments(c.cloud->points, c.flat(), c.fine, ratio);
            std::map<std::size_t, std::int32_t> labelOfGroup;
            std::set<std::int32_t> labels;
            for (std::size_t t = 0; t < c.flat().size(); ++t) {
                const std::int32_t before = c.fine.ofTetrahedron[t];
                const std::int32_t after = merged.ofTetrahedron[t];
                ASSERT_EQ(before < 0, after < 0);
                if (before < 0) continue;
                labels.insert(after);
                const auto known = labelOfGroup.emplace(group[static_cast<std::size_t>(before)], after);
                ASSERT_EQ(known.first->second, after) << c.cloud->name << ": one group, one label";
            }
            EXPECT_EQ(labels.size(), labelOfGroup.size()) << c.cloud->name << ": one label, one group";
            EXPECT_EQ(merged.maxima.size(), labels.size());
            mergedAway += n - merged.maxima.size();
            // The maximum of a merged segment is the first, that is the largest, of its group.
            for (const auto& [first, label] : labelOfGroup) {
                EXPECT_EQ(merged.maxima[static_cast<std::size_t>(label)], c.fine.maxima[first]);
            }
            EXPECT_TRUE(std::is_sorted(labels.begin(), labels.end()));
            EXPECT_EQ(labels.empty() ? -1 : *labels.rbegin(), static_cast<std::int32_t>(labels.size()) - 1);
        }
    }
    EXPECT_GT(mergedAway, 1000U);
}

TEST(StableManifolds, ComeByFallingMaximum) {
    for (const Case& c : cases()) {
        const auto strength = strengths(c);
        double last = std::numeric_limits<double>::infinity();
        for (const std::uint32_t maximum : c.fine.maxima) {
            if (strength[maximum] < 0.0) break;  // islands come after all maxima
            EXPECT_LE(c.flat().circumradii[maximum], last);
            last = c.flat().circumradii[maximum];
        }
    }
}

}  // namespace
}  // namespace shapedb
