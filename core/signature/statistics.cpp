// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/signature/footprint.h"
#include "core/signature/histogram.h"
#include "core/signature/inner_distances.h"
#include "core/signature/local_spread.h"
#include "core/signature/shell_harmonics.h"
#include "core/signature/voxels.h"

namespace shapedb {

namespace {

constexpr std::size_t kThicknessBins = 6;
constexpr std::size_t kPlaceBins = 10;
constexpr std::size_t kChordLengths = 12;
constexpr std::size_t kChordShares = 4;
constexpr std::size_t kBendingBins = 24;
constexpr std::size_t kChangeBins = 16;
constexpr std::size_t kDistanceBins = 32;
constexpr std::size_t kSpreadMiddles = 5;
constexpr std::size_t kSpreadShortests = 4;
constexpr std::size_t kOutlinePlaces = 10;
constexpr std::size_t kOutlineWidths = 4;
constexpr std::size_t kOutlineDistances = 20;
constexpr std::size_t kChords = 100000;
// Every statistic starts a stream of its own, so none depends on which others were computed before it.
constexpr std::uint64_t kChordSeed = 145;
/// About a millisecond.
constexpr std::size_t kChordsBetweenCheckpoints = 1024;

const StatisticLayout& layout(Statistic statistic) {
    return kStatistics[static_cast<std::size_t>(statistic)];
}

std::uint8_t* binsOf(ShapeStatistics& statistics, Statistic statistic) {
    return statistics.data() + layout(statistic).offset;
}

// Local thickness, in octaves of the mean distance between surface points: from 1/32 of it (a sheet) to 1.4
// times (no ball that fits is larger).
SoftBin thicknessBin(const InteriorView& view, std::size_t t) {
    return softBin(std::log2(view.radii[t] / view.meanSurfaceDistance), -5.0, 0.5, kThicknessBins);
}

void thicknessByRadius(const InteriorView& view, std::uint8_t* out) {
    Histogram histogram(kThicknessBins, kPlaceBins);
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        const double radius = length(view.centroids[t]) / view.meanRadius;
        histogram.add(thicknessBin(view, t), softBin(radius, 0.0, 2.2, kPlaceBins), view.volumes[t]);
    }
    histogram.writeLevels(out);
}

// Mean inner distance of each cell to the sources in its piece, in units of the overall mean: about 0.7 in
// the middle of a body, above 1.5 at the tips of its limbs.
std::vector<double> centrality(const InnerDistances& inner) {
    std::vector<double> result(inner.centres.size(), 0.0);
    for (std::size_t c = 0; c < result.size(); ++c) {
        double sum = 0.0;
        double count = 0.0;
        for (const auto& row : inner.distance) {
            if (row[c] >= InnerDistances::kUnreached) continue;
            sum += row[c];
            count += 1.0;
        }
        // A piece without a source counts as far from everything, like the tips of limbs.
        result[c] = count > 0.0 ? sum / count / inner.mean : 2.0;
    }
    return result;
}

void thicknessByCentrality(const InteriorView& view, const InnerDistances& inner, std::uint8_t* out) {
    const std::vector<double> central = centrality(inner);
    Histogram histogram(kThicknessBins, kPlaceBins);
    for (const InnerDistances::Matter& m : inner.matter) {
        if (m.cell == InnerDistances::kNoCell) continue;
        const SoftBin place = softBin(central[m.cell], 0.4, 1.8, kPlaceBins);
        histogram.add(thicknessBin(view, m.tetrahedron), place, 1.0);
    }
    histogram.writeLevels(out);
}

void bending(const InnerDistances& inner, std::uint8_t* out) {
    Histogram histogram(1, kBendingBins);
    for (std::size_t s = 0; s < inner.sources.size(); ++s) {
        const Point3& from = inner.centres[inner.sources[s]];
        for (std::size_t c = 0; c < inner.centres.size(); ++c) {
            if (c == inner.sources[s] || inner.distance[s][c] >= InnerDistances::kUnreached) continue;
            const double straight = distance(from, inner.centres[c]) / inner.mean;
            histogram.add(softBin(straight, 0.0, 2.6, kBendingBins), inner.volumes[c]);
        }
    }
    histogram.writeLevels(out);
}

// The largest ball at a point of matter of each cell, in octaves; kNoThickness where there is none. Small
// balls between the points of a noisy surface do not count then.
constexpr double kNoThickness = -1e300;
std::vector<double> thicknessOfCells(const InteriorView& view, const InnerDistances& inner) {
    std::vector<double> octaves(inner.centres.size(), kNoThickness);
    for (const InnerDistances::Matter& m : inner.matter) {
        if (m.cell == InnerDistances::kNoCell) continue;
        octaves[m.cell] = std::max(octaves[m.cell], std::log2(view.radii[m.tetrahedron]));
    }
    return octaves;
}

void thicknessChange(const InteriorView& view, const InnerDistances& inner, std::uint8_t* out) {
    const std::vector<double> octaves = thicknessOfCells(view, inner);
    Histogram histogram(1, kChangeBins);
    for (std::size_t s = 0; s < inner.sources.size(); ++s) {
        const double from = octaves[inner.sources[s]];
        if (from == kNoThickness) continue;
        for (std::size_t c = 0; c < inner.centres.size(); ++c) {
            if (c == inner.sources[s] || inner.distance[s][c] >= InnerDistances::kUnreached) continue;
            if (octaves[c] == kNoThickness) continue;
            histogram.add(softBin(std::abs(octaves[c] - from), 0.0, 3.0, kChangeBins), inner.volumes[c]);
        }
    }
    histogram.writeLevels(out);
}

void surfaceDistances(const InteriorView& view, std::uint8_t* out) {
    Random random(kChordSeed);
    Histogram histogram(1, kDistanceBins);
    const std::size_t n = view.surface.size();
    for (std::size_t i = 0; i < InteriorView::kPairs; ++i) {
        const std::size_t a = random.below(n);
        const std::size_t b = random.below(n);
        if (a == b) continue;
        const double d = distance(view.surface[a], view.surface[b]);
        histogram.add(softBin(d, 0.0, 1.0, kDistanceBins), 1.0);
    }
    histogram.writeLevels(out);
}

/// Once the context is cancelled what is written means nothing.
void chords(const InteriorView& view, std::uint8_t* out, const RunContext& context) {
    const Voxels voxels(view);
    Random random(kChordSeed);
    Histogram histogram(kChordLengths, kChordShares);
    const std::size_t n = view.surface.size();
    for (std::size_t i = 0; i < kChords; ++i) {
        if (i % kChordsBetweenCheckpoints == 0 && !context.checkpoint()) return;
        const Point3& a = view.surface[random.below(n)];
        const Point3& b = view.surface[random.below(n)];
        const double d = distance(a, b);
        if (!(d > 0.0)) continue;
        histogram.add(softBin(d / view.meanSurfaceDistance, 0.0, 2.4, kChordLengths),
                      softBin(voxels.shareInside(a, b), 0.0, 1.0, kChordShares), 1.0);
    }
    histogram.writeLevels(out);
}

void spread(const InteriorView& view, std::uint8_t* out) {
    Histogram histogram(kSpreadMiddles, kSpreadShortests);
    for (const LocalSpread& s : localSpread(view.surface)) {
        histogram.add(softBin(s.middle, 0.0, 1.0, kSpreadMiddles),
                      softBin(s.shortest, 0.0, 0.8, kSpreadShortests), 1.0);
    }
    histogram.writeLevels(out);
}

// The distance from the long axis is in octaves of the length, from 1/64 to the corners of a square.
void placesInOutline(const std::vector<OutlinePoint>& outline, std::uint8_t* out) {
    Histogram histogram(kOutlinePlaces, kOutlineWidths);
    for (const OutlinePoint& p : outline) {
        // The limit keeps points on the axis finite; it is far below the first bin.
        const double across = std::log2(std::max(std::abs(p[1]), 1e-4));
        histogram.add(softBin(p[0], 0.0, 1.0, kOutlinePlaces), softBin(across, -6.0, -0.5, kOutlineWidths),
                      1.0);
    }
    histogram.writeLevels(out);
}

void distancesInOutline(const std::vector<OutlinePoint>& outline, std::uint8_t* out) {
    Random random(kChordSeed);
    Histogram histogram(1, kOutlineDistances);
    for (std::size_t i = 0; i < kChords && outline.size() > 1; ++i) {
        const OutlinePoint& a = outline[random.below(outline.size())];
        const OutlinePoint& b = outline[random.below(outline.size())];
        histogram.add(softBin(std::hypot(a[0] - b[0], a[1] - b[1]), 0.0, 1.1, kOutlineDistances), 1.0);
    }
    histogram.writeLevels(out);
}

void harmonics(const PointCloud& points, const std::vector<double>& weights, std::uint8_t* out) {
    const ShellEnergies energies = shellHarmonics(points, weights);
    for (std::size_t i = 0; i < energies.size(); ++i) out[i] = levelOf(energies[i]);
}

}  // namespace

Result<ShapeStatistics> shapeStatistics(const InteriorView& view, const RunContext& context) {
    ShapeStatistics result{};
    const auto bins = [&](Statistic statistic) { return binsOf(result, statistic); };
    Result<void> insideDone;
    const auto inside = [&] {
        const auto inner = innerDistances(view, context);
        if (!inner) {
            insideDone = fail(inner.error());
            return;
        }
        thicknessByCentrality(view, *inner, bins(Statistic::kThicknessByCentrality));
        bending(*inner, bins(Statistic::kBending));
        thicknessChange(view, *inner, bins(Statistic::kThicknessChange));
    };
    const auto lines = [&] {
        chords(view, bins(Statistic::kChords), context);
        if (!context.checkpoint()) return;
        surfaceDistances(view, bins(Statistic::kSurfaceDistances));
    };
    const auto rest = [&] {
        thicknessByRadius(view, bins(Statistic::kThicknessByRadius));
        harmonics(view.centroids, view.volumes, bins(Statistic::kInteriorHarmonics));
        if (!context.checkpoint()) return;
        harmonics(view.surface, {}, bins(Statistic::kSurfaceHarmonics));
        // Reported at the end.
        if (!context.checkpoint()) return;
        spread(view, bins(Statistic::kSpread));
        const std::vector<OutlinePoint> outline = footprint(view.surface);
        placesInOutline(outline, bins(Statistic::kFootprint));
        distancesInOutline(outline, bins(Statistic::kFootprintDistances));
    };
    // Each writes its own bins, so the number of threads makes no difference.
    parallelInvoke(inside, lines, rest);
    RETURN_IF_ERROR(insideDone);
    RETURN_IF_ERROR(context.checkpoint());
    return result;
}

}  // namespace shapedb
