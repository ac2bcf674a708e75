// SPDX-License-Identifier: GPL-3.0-or-later
// Each statistic against a second implementation of its definition, and for shapes with known answers.
#include "core/signature/statistics.h"

#include <atomic>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/pipeline.h"
#include "core/signature/footprint.h"
#include "core/signature/inner_distances.h"
#include "core/signature/local_spread.h"
#include "core/signature/shell_harmonics.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::cubeBlock;
using testing_support::horseshoe;
using testing_support::levelsOf;
using testing_support::together;
using testing_support::triangle;
using testing_support::viewOfCubes;

constexpr std::size_t kPlaces = 10;
constexpr std::size_t kThicknesses = 6;

// How much rounding to a level can change a share of up to a tenth or so.
constexpr double kHalfALevel = 0.02;

std::vector<std::uint8_t> binsOf(const ShapeStatistics& statistics, Statistic which) {
    const StatisticLayout& layout = kStatistics[static_cast<std::size_t>(which)];
    return {statistics.begin() + layout.offset, statistics.begin() + layout.offset + layout.count};
}

void expectBins(const std::vector<std::uint8_t>& got, const std::vector<std::uint8_t>& expected,
                const char* what) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    for (std::size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], expected[i], 1) << what << " bin " << i;
}

// Back to shares of the whole: the squares of the roots.
std::vector<double> sharesOf(const ShapeStatistics& statistics, Statistic which) {
    std::vector<double> shares;
    double sum = 0.0;
    for (const std::uint8_t b : binsOf(statistics, which)) {
        shares.push_back(shareOfLevel(b));
        sum += shares.back();
    }
    for (double& s : shares) s /= sum;
    return shares;
}

std::vector<InteriorView> someViews() {
    return {viewOfCubes(horseshoe(10, 2, 2), 0.06), viewOfCubes(cubeBlock({0, 0, 0}, {12, 2, 2}), 0.08),
            viewOfCubes(together(cubeBlock({0, 0, 0}, {4, 4, 4}), cubeBlock({6, 0, 0}, {8, 2, 2})), 0.1)};
}

ShapeStatistics ofScan(const Solid& solid) {
    const PointCloud points = sampleBoundary(solid, 4000, 3).value();
    return describe(points, parametersOf(Profile::kDefault)).value().signature.attributes->statistics;
}

TEST(Statistics, LayoutHasNoGapsOrOverlaps) {
    std::size_t next = 0;
    std::set<std::string> names;
    for (const StatisticLayout& layout : kStatistics) {
        EXPECT_EQ(layout.offset, next) << "persisted: " << layout.name;
        next += layout.count;
        names.insert(layout.name);
    }
    EXPECT_EQ(next, kStatisticBins);
    EXPECT_EQ(kStatisticBins, 448U) << "persisted";
    EXPECT_EQ(kEarlierStatisticBins, 432U) << "persisted";
    EXPECT_EQ(names.size(), kStatisticKinds);
    EXPECT_STREQ(kStatistics[static_cast<std::size_t>(Statistic::kChords)].name, "chords");
    EXPECT_STREQ(kStatistics[static_cast<std::size_t>(Statistic::kSurfaceHarmonics)].name,
                 "surface harmonics");
    EXPECT_STREQ(kStatistics[static_cast<std::size_t>(Statistic::kFootprintDistances)].name,
                 "footprint distances");
    EXPECT_STREQ(kStatistics[static_cast<std::size_t>(Statistic::kThicknessChange)].name, "thickness change");
}

TEST(Statistics, ThicknessByRadiusMatchesItsDefinition) {
    for (const InteriorView& view : someViews()) {
        std::vector<double> sums(kThicknesses * kPlaces, 0.0);
        for (std::size_t t = 0; t < view.volumes.size(); ++t) {
            const double octaves = std::log2(view.radii[t] / view.meanSurfaceDistance);
            const double radius = length(view.centroids[t]) / view.meanRadius;
            for (std::size_t row = 0; row < kThicknesses; ++row) {
                for (std::size_t column = 0; column < kPlaces; ++column) {
                    sums[row * kPlaces + column] += view.volumes[t] *
                                                    triangle(octaves, -5.0, 0.5, kThicknesses, row) *
                                                    triangle(radius, 0.0, 2.2, kPlaces, column);
                }
            }
        }
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        expectBins(binsOf(*statistics, Statistic::kThicknessByRadius), levelsOf(sums), "thickness by radius");
    }
}

TEST(Statistics, ThicknessByCentralityMatchesItsDefinition) {
    for (const InteriorView& view : someViews()) {
        const InnerDistances inner = innerDistances(view).value();
        std::vector<double> sums(kThicknesses * kPlaces, 0.0);
        for (const auto& [t, cell] : inner.matter) {
            ASSERT_NE(cell, InnerDistances::kNoCell);
            double sum = 0.0;
            int reached = 0;
            for (std::size_t s = 0; s < inner.sources.size(); ++s) {
                if (inner.distance[s][cell] == InnerDistances::kUnreached) continue;
                sum += inner.distance[s][cell];
                ++reached;
            }
            // A separate piece without a source counts as farthest out.
            const double central = reached > 0 ? sum / reached / inner.mean : 1e9;
            const double octaves = std::log2(view.radii[t] / view.meanSurfaceDistance);
            for (std::size_t row = 0; row < kThicknesses; ++row) {
                for (std::size_t column = 0; column < kPlaces; ++column) {
                    sums[row * kPlaces + column] += triangle(octaves, -5.0, 0.5, kThicknesses, row) *
                                                    triangle(central, 0.4, 1.8, kPlaces, column);
                }
            }
        }
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        expectBins(binsOf(*statistics, Statistic::kThicknessByCentrality), levelsOf(sums),
                   "thickness by centrality");
    }
}

TEST(Statistics, BendingMatchesItsDefinition) {
    for (const InteriorView& view : someViews()) {
        const InnerDistances inner = innerDistances(view).value();
        std::vector<double> sums(24, 0.0);
        for (std::size_t s = 0; s < inner.sources.size(); ++s) {
            for (std::size_t c = 0; c < inner.centres.size(); ++c) {
                if (c == inner.sources[s] || inner.distance[s][c] == InnerDistances::kUnreached) continue;
                const double straight = distance(inner.centres[inner.sources[s]], inner.centres[c]);
                for (std::size_t bin = 0; bin < sums.size(); ++bin) {
                    sums[bin] += inner.volumes[c] * triangle(straight / inner.mean, 0.0, 2.6, 24, bin);
                }
            }
        }
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        expectBins(binsOf(*statistics, Statistic::kBending), levelsOf(sums), "bending");
    }
}

TEST(Statistics, ThicknessChangeMatchesItsDefinition) {
    for (const InteriorView& view : someViews()) {
        const InnerDistances inner = innerDistances(view).value();
        std::vector<double> radii(inner.centres.size(), 0.0);
        for (const auto& [t, cell] : inner.matter) radii[cell] = std::max(radii[cell], view.radii[t]);
        std::vector<double> sums(16, 0.0);
        for (std::size_t s = 0; s < inner.sources.size(); ++s) {
            const std::size_t from = inner.sources[s];
            for (std::size_t c = 0; c < inner.centres.size(); ++c) {
                if (c == from || inner.distance[s][c] == InnerDistances::kUnreached) continue;
                if (radii[c] == 0.0 || radii[from] == 0.0) continue;
                const double change = std::abs(std::log2(radii[c] / radii[from]));
                for (std::size_t bin = 0; bin < sums.size(); ++bin) {
                    sums[bin] += inner.volumes[c] * triangle(change, 0.0, 3.0, 16, bin);
                }
            }
        }
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        expectBins(binsOf(*statistics, Statistic::kThicknessChange), levelsOf(sums), "thickness change");
    }
}

TEST(Statistics, ThicknessChangesWherePartsDo) {
    const auto mean = [](const Solid& solid) {
        const auto shares = sharesOf(ofScan(solid), Statistic::kThicknessChange);
        double sum = 0.0;
        for (std::size_t i = 0; i < shares.size(); ++i) sum += shares[i] * (static_cast<double>(i) + 0.5);
        return sum * 3.0 / 16.0;
    };
    const double ofBall = mean(makeSphere().solid);
    const double ofTorus = mean(makeTorus().solid);
    const double ofDumbbell = mean(makeDumbbell().solid);
    EXPECT_LT(ofBall, 0.3);
    EXPECT_LT(ofTorus, 0.3);
    EXPECT_GT(ofDumbbell, 1.5 * ofBall);
}

TEST(Statistics, SurfaceDistancesAndHarmonicsMatchTheirDefinitions) {
    for (const InteriorView& view : someViews()) {
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        std::vector<double> sums(32, 0.0);
        for (std::size_t i = 0; i < view.surface.size(); ++i) {
            for (std::size_t j = 0; j < view.surface.size(); ++j) {
                if (i == j) continue;
                const double d = distance(view.surface[i], view.surface[j]);
                for (std::size_t bin = 0; bin < 32; ++bin) sums[bin] += triangle(d, 0.0, 1.0, 32, bin);
            }
        }
        // kPairs random pairs instead of all: levels differ by at most one.
        const auto drawn = binsOf(*statistics, Statistic::kSurfaceDistances);
        const auto all = levelsOf(sums);
        for (std::size_t bin = 0; bin < drawn.size(); ++bin) {
            EXPECT_NEAR(static_cast<double>(drawn[bin]), static_cast<double>(all[bin]), 1.0) << bin;
        }

        const auto harmonics = [](const PointCloud& points, const std::vector<double>& weights) {
            std::vector<std::uint8_t> bytes;
            for (const double e : shellHarmonics(points, weights)) {
                const double root = std::floor(255.0 * std::sqrt(e) + 0.5) / 255.0;
                bytes.push_back(static_cast<std::uint8_t>(
                    std::min(15.0, std::floor(15.0 * std::sqrt(2.0) * root + 0.5))));
            }
            return bytes;
        };
        EXPECT_EQ(binsOf(*statistics, Statistic::kInteriorHarmonics),
                  harmonics(view.centroids, view.volumes));
        EXPECT_EQ(binsOf(*statistics, Statistic::kSurfaceHarmonics), harmonics(view.surface, {}));
    }
}

TEST(Statistics, SpreadAndFootprintMatchTheirDefinitions) {
    for (const InteriorView& view : someViews()) {
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        std::vector<double> spreads(5 * 4, 0.0);
        for (const LocalSpread& s : localSpread(view.surface)) {
            for (std::size_t bin = 0; bin < spreads.size(); ++bin) {
                spreads[bin] +=
                    triangle(s.middle, 0.0, 1.0, 5, bin / 4) * triangle(s.shortest, 0.0, 0.8, 4, bin % 4);
            }
        }
        expectBins(binsOf(*statistics, Statistic::kSpread), levelsOf(spreads), "spread");

        const std::vector<OutlinePoint> outline = footprint(view.surface);
        std::vector<double> places(10 * 4, 0.0);
        std::vector<double> distances(20, 0.0);
        for (const OutlinePoint& p : outline) {
            const double octaves = std::log2(std::abs(p[1]) + 1e-300);
            for (std::size_t bin = 0; bin < places.size(); ++bin) {
                places[bin] +=
                    triangle(p[0], 0.0, 1.0, 10, bin / 4) * triangle(octaves, -6.0, -0.5, 4, bin % 4);
            }
            for (const OutlinePoint& q : outline) {
                const double d = std::hypot(p[0] - q[0], p[1] - q[1]);
                for (std::size_t bin = 0; bin < 20; ++bin) distances[bin] += triangle(d, 0.0, 1.1, 20, bin);
            }
        }
        expectBins(binsOf(*statistics, Statistic::kFootprint), levelsOf(places), "footprint");
        const auto drawn = binsOf(*statistics, Statistic::kFootprintDistances);
        const auto all = levelsOf(distances);
        for (std::size_t bin = 0; bin < drawn.size(); ++bin) {
            EXPECT_NEAR(static_cast<double>(drawn[bin]), static_cast<double>(all[bin]), 3.0) << bin;
        }
    }
}

TEST(Statistics, ChordsAreAsLongAsAllPairsOfSurfacePoints) {
    for (const InteriorView& view : someViews()) {
        const auto statistics = shapeStatistics(view);
        ASSERT_TRUE(statistics);
        const auto shares = sharesOf(*statistics, Statistic::kChords);
        ASSERT_EQ(shares.size(), 48U);
        std::vector<double> expected(12, 0.0);
        double pairs = 0.0;
        for (const Point3& p : view.surface) {
            for (const Point3& q : view.surface) {
                const double d = distance(p, q);
                if (d == 0.0) continue;
                pairs += 1.0;
                for (std::size_t row = 0; row < 12; ++row) {
                    expected[row] += triangle(d / view.meanSurfaceDistance, 0.0, 2.4, 12, row);
                }
            }
        }
        for (std::size_t row = 0; row < 12; ++row) {
            double share = 0.0;
            for (std::size_t column = 0; column < 4; ++column) share += shares[4 * row + column];
            EXPECT_NEAR(share, expected[row] / pairs, kHalfALevel) << "length " << row;
        }
    }
}

// Share of the chords that lie inside over their whole length.
double insideAllTheWay(const ShapeStatistics& statistics) {
    const auto shares = sharesOf(statistics, Statistic::kChords);
    double sum = 0.0;
    for (std::size_t length = 0; length < 12; ++length) sum += shares[4 * length + 3];
    return sum;
}

TEST(Statistics, ChordsOfConvexShapesStayInside) {
    const double sphere = insideAllTheWay(ofScan(makeSphere().solid));
    const double box = insideAllTheWay(ofScan(makeBox().solid));
    const double torus = insideAllTheWay(ofScan(makeTorus().solid));
    EXPECT_GT(sphere, 0.9);
    EXPECT_GT(box, 0.7) << "those within a face run along the skin";
    EXPECT_LT(torus, 0.6);
}

TEST(Statistics, ThicknessOfABallIsItsRadius) {
    // Radius 1, mean surface distance 4/3: log2(3/4) lies between the centres of rows 4 and 5.
    const auto shares = sharesOf(ofScan(makeSphere().solid), Statistic::kThicknessByRadius);
    double thick = 0.0;
    for (std::size_t i = 4 * kPlaces; i < shares.size(); ++i) thick += shares[i];
    EXPECT_GT(thick, 0.97);
    // Surface distances of a sphere of diameter 2 and diagonal 2 sqrt(3): density rising with d up to
    // 1/sqrt(3) = 18.5 bins, nothing beyond.
    const auto d2 = sharesOf(ofScan(makeSphere().solid), Statistic::kSurfaceDistances);
    for (std::size_t bin = 1; bin < 17; ++bin) {
        EXPECT_NEAR(d2[bin], 2.0 * (static_cast<double>(bin) + 0.5) * 3.0 / (32.0 * 32.0), kHalfALevel)
            << bin;
    }
    for (std::size_t bin = 21; bin < 32; ++bin) EXPECT_LT(d2[bin], 0.005) << bin;
}

TEST(Statistics, AStraightRodIsLongerThanABentOne) {
    const auto mean = [](const std::vector<double>& shares) {
        double sum = 0.0;
        for (std::size_t i = 0; i < shares.size(); ++i) sum += shares[i] * (static_cast<double>(i) + 0.5);
        return sum * 2.6 / static_cast<double>(shares.size());
    };
    const auto straight = shapeStatistics(viewOfCubes(cubeBlock({0, 0, 0}, {40, 2, 2}), 1.0 / 40));
    const auto bent = shapeStatistics(viewOfCubes(horseshoe(20, 2, 3), 1.0 / 20));
    ASSERT_TRUE(straight && bent);
    const double ofStraight = mean(sharesOf(*straight, Statistic::kBending));
    const double ofBent = mean(sharesOf(*bent, Statistic::kBending));
    // In units of the mean inner distance, which for a straight rod is the straight line.
    EXPECT_GT(ofStraight, 0.7);
    EXPECT_LT(ofStraight, 1.02);
    EXPECT_LT(ofBent, 0.75 * ofStraight);
}

TEST(Statistics, BendingAnArmChangesInnerDistancesLess) {
    // A long rod, straight and as a U: thickness by centrality hardly changes, the harmonics do.
    const auto straight = shapeStatistics(viewOfCubes(cubeBlock({0, 0, 0}, {43, 2, 2}), 1.0 / 43));
    const auto bent = shapeStatistics(viewOfCubes(horseshoe(20, 2, 3), 1.0 / 20));
    ASSERT_TRUE(straight && bent);
    const auto columns = [](const ShapeStatistics& statistics, Statistic which) {
        std::vector<double> sums(kPlaces, 0.0);
        const auto shares = sharesOf(statistics, which);
        for (std::size_t i = 0; i < shares.size(); ++i) sums[i % kPlaces] += shares[i];
        return sums;
    };
    const auto difference = [&](Statistic which) {
        const auto a = columns(*straight, which);
        const auto b = columns(*bent, which);
        double sum = 0.0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
        return sum;
    };
    EXPECT_LT(difference(Statistic::kThicknessByCentrality), 0.6 * difference(Statistic::kThicknessByRadius));
}

TEST(Statistics, CanBeCancelled) {
    const InteriorView view = viewOfCubes(cubeBlock({0, 0, 0}, {3, 3, 3}), 0.2);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(shapeStatistics(view, context).error().code, ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now() - std::chrono::seconds(1);
    EXPECT_EQ(shapeStatistics(view, late).error().code, ErrorCode::kDeadlineExceeded);
    EXPECT_EQ(*shapeStatistics(view), *shapeStatistics(view)) << "deterministic";
}

}  // namespace
}  // namespace shapedb
