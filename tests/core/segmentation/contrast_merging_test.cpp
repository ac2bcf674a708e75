// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/contrast_merging.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/segmentation/flow.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

constexpr ContrastMerging kOnlyAlike{1.3, 0.0, 0};

std::vector<std::uint32_t> merge(const SegmentGraph& graph, const ContrastMerging& options) {
    return mergeByContrast(graph, options).value();
}

std::size_t countOf(const std::vector<std::uint32_t>& groups) {
    return std::set<std::uint32_t>(groups.begin(), groups.end()).size();
}

// Segments in a row; the saddle radius of two neighbours is given between their radii.
SegmentGraph row(const std::vector<double>& radii, const std::vector<double>& saddles) {
    SegmentGraph graph{std::vector<double>(radii.size(), 1.0), radii, {}};
    for (std::uint32_t i = 0; i < saddles.size(); ++i) graph.contacts.push_back({i, i + 1, saddles[i], 1.0});
    return graph;
}

// Random contacts, radii and volumes over three powers of ten, some segments without contact.
SegmentGraph randomGraph(Random& random, std::uint32_t count) {
    SegmentGraph graph;
    for (std::uint32_t i = 0; i < count; ++i) {
        graph.volumes.push_back(std::pow(10.0, -3.0 * random.uniform()));
        graph.radii.push_back(std::pow(2.0, -3.0 * random.uniform()));
    }
    for (std::uint32_t a = 0; a < count; ++a) {
        for (std::uint32_t b = a + 1; b < count; ++b) {
            if (random.uniform() > 3.0 / count) continue;
            const double narrower = std::min(graph.radii[a], graph.radii[b]);
            graph.contacts.push_back({a, b, narrower * (0.7 + 0.3 * random.uniform()), 1.0});
        }
    }
    return graph;
}

// The graph of the groups, computed from scratch.
struct Left {
    std::vector<double> volumes;
    std::vector<double> radii;
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> saddles;

    Left(const SegmentGraph& graph, const std::vector<std::uint32_t>& groups)
        : volumes(countOf(groups)), radii(volumes.size()) {
        for (std::size_t i = 0; i < groups.size(); ++i) {
            volumes[groups[i]] += graph.volumes[i];
            radii[groups[i]] += graph.volumes[i] * std::log(graph.radii[i]);
        }
        for (std::size_t g = 0; g < radii.size(); ++g) radii[g] = std::exp(radii[g] / volumes[g]);
        for (const SegmentContact& c : graph.contacts) {
            const auto [low, high] = std::minmax(groups[c.first], groups[c.second]);
            if (low == high) continue;
            double& widest = saddles[{low, high}];
            widest = std::max(widest, c.saddleRadius);
        }
    }
    std::set<std::uint32_t> touching() const {
        std::set<std::uint32_t> all;
        for (const auto& [pair, saddleRadius] : saddles) all.insert({pair.first, pair.second});
        return all;
    }
};

TEST(MergeByContrast, KeepsALimbOfManyMaximaApartFromTheBody) {
    // A body of radius 3; a limb of radius 1 with a root as wide as itself; a hand.
    const SegmentGraph graph = row({3.0, 1.02, 0.98, 1.01, 1.0, 1.6}, {0.99, 0.95, 0.94, 0.96, 0.93});
    EXPECT_EQ(merge(graph, kOnlyAlike), (std::vector<std::uint32_t>{0, 1, 1, 1, 1, 2}));
}

TEST(MergeByContrast, ANeckSeparatesEqualSegments) {
    EXPECT_EQ(countOf(merge(row({1.0, 1.0}, {0.7}), kOnlyAlike)), 2U);
    EXPECT_EQ(countOf(merge(row({1.0, 1.0}, {0.8}), kOnlyAlike)), 1U);
}

TEST(MergeByContrast, GroupsAreConnectedAndEveryPairLeftIsAboveTheContrast) {
    Random random(1);
    std::size_t pairs = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const SegmentGraph graph = randomGraph(random, 120);
        const auto groups = merge(graph, kOnlyAlike);
        const Left left(graph, groups);
        for (const auto& [pair, saddleRadius] : left.saddles) {
            const double ra = left.radii[pair.first];
            const double rb = left.radii[pair.second];
            EXPECT_GT(std::max(ra, rb) / std::min({ra, rb, saddleRadius}), 1.3 * (1.0 - 2.1e-3));
            ++pairs;
        }
        // Connected: growth from the first segment of each group, within the group, reaches all of it.
        std::vector<std::uint32_t> reached(groups.size());
        std::iota(reached.begin(), reached.end(), 0U);
        for (bool changed = true; changed;) {
            changed = false;
            for (const SegmentContact& c : graph.contacts) {
                if (groups[c.first] != groups[c.second] || reached[c.first] == reached[c.second]) continue;
                reached[c.first] = reached[c.second] = std::min(reached[c.first], reached[c.second]);
                changed = true;
            }
        }
        EXPECT_EQ(countOf(reached), left.volumes.size());
    }
    EXPECT_GT(pairs, 1000U);
}

TEST(MergeByContrast, DoesNotDependOnTheOrderOfSegments) {
    Random random(2);
    for (int trial = 0; trial < 60; ++trial) {
        const SegmentGraph graph = randomGraph(random, 80);
        std::vector<std::uint32_t> to(graph.radii.size());
        std::iota(to.begin(), to.end(), 0U);
        for (std::size_t i = to.size() - 1; i > 0; --i) {
            std::swap(to[i], to[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
        }
        SegmentGraph shuffled = graph;
        for (std::size_t i = 0; i < to.size(); ++i) {
            shuffled.volumes[to[i]] = graph.volumes[i];
            shuffled.radii[to[i]] = graph.radii[i];
        }
        for (SegmentContact& c : shuffled.contacts) {
            const auto [low, high] = std::minmax(to[c.first], to[c.second]);
            c.first = low;
            c.second = high;
        }
        const ContrastMerging options{1.3, 0.01, 9};
        const auto groups = merge(graph, options);
        const auto other = merge(shuffled, options);
        std::map<std::uint32_t, std::uint32_t> same;
        for (std::size_t i = 0; i < to.size(); ++i) {
            EXPECT_EQ(same.emplace(groups[i], other[to[i]]).first->second, other[to[i]]) << "trial " << trial;
        }
        EXPECT_EQ(countOf(groups), countOf(other));
    }
}

TEST(MergeByContrast, MergesLightGroupsAndThoseBeyondTheLimit) {
    Random random(3);
    for (int trial = 0; trial < 60; ++trial) {
        const SegmentGraph graph = randomGraph(random, 200);
        const ContrastMerging options{1.1, 0.02, 12};
        const auto groups = merge(graph, options);
        const Left left(graph, groups);
        const double total = std::accumulate(graph.volumes.begin(), graph.volumes.end(), 0.0);
        const auto touching = left.touching();
        EXPECT_LE(touching.size(), 12U);
        for (const std::uint32_t group : touching) {
            EXPECT_GE(left.volumes[group], 0.02 * total * (1.0 - 1e-9));
        }
        // Groups are numbered by their first segments.
        std::uint32_t next = 0;
        for (const std::uint32_t group : groups) {
            ASSERT_LE(group, next);
            next = std::max(next, group + 1);
        }
    }
}

TEST(MergeByContrast, MergesALightGroupThroughTheLargestSaddle) {
    SegmentGraph graph{{10.0, 0.01, 5.0}, {3.0, 0.5, 1.0}, {{0, 1, 0.3, 9.0}, {1, 2, 0.4, 1.0}}};
    EXPECT_EQ(merge(graph, {1.2, 0.01, 0}), (std::vector<std::uint32_t>{0, 1, 1}));
    graph.contacts[0].saddleRadius = 0.45;
    EXPECT_EQ(merge(graph, {1.2, 0.01, 0}), (std::vector<std::uint32_t>{0, 0, 1}));
}

// Noise leaves separate dust, which must not cost the shape its limbs.
TEST(MergeByContrast, KeepsSeparateLumpsWithoutCountingThem) {
    SegmentGraph graph = row({3.0, 1.0, 0.3}, {0.9, 0.28});
    for (int i = 0; i < 100; ++i) {
        graph.volumes.push_back(1e-9);
        graph.radii.push_back(5.0);
    }
    EXPECT_EQ(countOf(merge(graph, {1.3, 0.004, 3})), 103U);
    EXPECT_EQ(countOf(merge(graph, {1.3, 0.004, 2})), 102U);
}

TEST(MergeByContrast, AcceptsFlatSegmentsWithoutVolume) {
    SegmentGraph graph = row({1.0, 1.0, 1.0}, {1.0, 0.5});
    graph.volumes = {0.0, 0.0, 0.0};
    EXPECT_EQ(countOf(merge(graph, kOnlyAlike)), 2U);
    EXPECT_TRUE(merge({}, kOnlyAlike).empty());
}

TEST(MergeByContrast, CanBeCancelled) {
    const std::size_t many = 20000;
    const SegmentGraph graph = row(std::vector<double>(many, 1.0), std::vector<double>(many - 1, 1.0));
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto groups = mergeByContrast(graph, kOnlyAlike, context);
    ASSERT_FALSE(groups);
    EXPECT_EQ(groups.error().code, ErrorCode::kCancelled);
}

TEST(MergeSegmentsByContrast, CoarsensThePartitionAndKeepsTheMaxima) {
    std::size_t mergedAway = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& flat = cloud.tetrahedra;
        const std::vector<std::uint8_t> all(flat.size(), 1);
        const auto flow = flowMasks(cloud.points, flat, all).value();
        const auto fine = stableManifolds(flat, all, flow).value();
        const auto merged = mergeSegmentsByContrast(cloud.points, flat, flow, fine, {1.3, 0.004, 16}).value();
        std::vector<std::int32_t> into(fine.maxima.size(), -1);
        std::vector<double> highest(merged.maxima.size(), 0.0);
        for (std::size_t t = 0; t < flat.size(); ++t) {
            std::int32_t& group = into[static_cast<std::size_t>(fine.ofTetrahedron[t])];
            if (group < 0) group = merged.ofTetrahedron[t];
            ASSERT_EQ(group, merged.ofTetrahedron[t]) << cloud.name;
        }
        for (std::size_t s = 0; s < fine.maxima.size(); ++s) {
            double& maximum = highest[static_cast<std::size_t>(into[s])];
            maximum = std::max(maximum, flat.circumradii[fine.maxima[s]]);
        }
        for (std::size_t g = 0; g < highest.size(); ++g) {
            EXPECT_EQ(highest[g], flat.circumradii[merged.maxima[g]]) << cloud.name;
            EXPECT_EQ(merged.ofTetrahedron[merged.maxima[g]], static_cast<std::int32_t>(g));
        }
        mergedAway += fine.maxima.size() - merged.maxima.size();
    }
    EXPECT_GT(mergedAway, 100U);
}

SegmentationOptions byContrast() {
    SegmentationOptions options;
    options.mergeContrast = 1.3;
    return options;
}

// The parts that a person would name, at several densities and with a little noise.
TEST(MergeSegmentsByContrast, FindsTheBallsAndRodsOfKnownShapes) {
    const std::map<std::string, std::ptrdiff_t> parts = {{"sphere", 1}, {"dumbbell", 3}, {"jack", 13}};
    for (const NamedShape& shape : namedShapes()) {
        const auto wanted = parts.find(shape.name);
        if (wanted == parts.end()) continue;
        for (const double noise : {0.0, 0.0015}) {
            for (const std::uint64_t seed : {1U, 2U}) {
                PointCloud points = sampleBoundary(shape.solid, 4000, seed).value();
                ASSERT_TRUE(addGaussianNoise(points, noise, seed + 10));
                const Segmentation s = segment(points, byContrast()).value();
                // Noise may leave separate dust, which is light.
                const auto heavy =
                    std::count_if(s.segments.begin(), s.segments.end(),
                                  [&](const Segment& part) { return part.volume >= 0.004 * s.volume; });
                EXPECT_EQ(heavy, wanted->second) << shape.name << " noise " << noise;
                for (std::size_t i = 0; i < std::min(shape.balls.size(), s.segments.size()); ++i) {
                    EXPECT_NEAR(s.segments[i].volume, shape.balls[i].volume(), 0.1 * shape.balls[i].volume())
                        << shape.name << " noise " << noise;
                }
            }
        }
    }
}

TEST(SegmentationOptions, ChecksTheRangesOfContrastMerging) {
    SegmentationOptions good;
    good.mergeContrast = 1.0;
    good.minSegmentShare = 1.0;
    good.maxSegments = 0;
    EXPECT_TRUE(validate(good));
    EXPECT_EQ(SegmentationOptions{}.mergeContrast, 0.0) << "the paper's merging is the default";
    const auto refused = [](double SegmentationOptions::*field, const std::string& name, double value) {
        SegmentationOptions options;
        options.*field = value;
        const auto valid = validate(options);
        ASSERT_FALSE(valid) << name << " " << value;
        EXPECT_EQ(valid.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(valid.error().message.find(name), std::string::npos) << valid.error().message;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    for (const double value : {-1.0, 0.5, nan, infinite}) {
        refused(&SegmentationOptions::mergeContrast, "merge_contrast", value);
    }
    for (const double value : {-0.1, 1.1, nan, infinite}) {
        refused(&SegmentationOptions::minSegmentShare, "min_segment_share", value);
    }
}

}  // namespace
}  // namespace shapedb
