// SPDX-License-Identifier: GPL-3.0-or-later
// Statistics of a shape's interior and surface as a whole: histograms that do not change under
// rotation, reflection, translation and scaling, and little under bending. They go beyond the paper,
// whose points and weights alone are a weak signature: docs/signature.md has reasons and figures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/interior_view.h"
#include "core/signature/statistic_level.h"

namespace shapedb {

/// Persisted order: never change it, add a signature version.
enum class Statistic : std::uint8_t {
    kChords,                 ///< straight lines between surface points: length by fraction inside
    kThicknessByCentrality,  ///< local thickness (circumradius) by mean inside distance to the rest
    kThicknessByRadius,      ///< local thickness by distance from the centroid
    kBending,                ///< straight distances in units of the mean inside distance
    kInteriorHarmonics,      ///< spherical-harmonic energies of the interior in shells
    kSurfaceDistances,       ///< distances between surface points (D2), in units of the size
    kSurfaceHarmonics,       ///< as the interior's, of the surface points
    kSpread,                 ///< whether the surface around its points is like a rod, a sheet or a body
    kFootprint,              ///< the outline: place along it by distance from its long axis
    kFootprintDistances,     ///< distances between points of the outline, in units of its length
    kThicknessChange,        ///< how much the local thickness differs between two places inside
};
constexpr std::size_t kStatisticKinds = 11;

/// What a scan must show for a statistic to be reliable.
enum class Evidence : std::uint8_t {
    kInside,   ///< the whole surface, so that the interior is known
    kSurface,  ///< most of the surface; a scan of one side is roughly enough (the fraction of a chord
               ///< inside hardly depends on how thick a thin shape is taken to be)
    kOutline,  ///< one side, seen from above as the shape lies
};

struct StatisticLayout {
    const char* name;      ///< for people: "chords"; static storage
    std::uint16_t offset;  ///< of its first bin
    std::uint16_t count;   ///< bins
    Evidence evidence;
    /// Number of rows when their direction is arbitrary, so that two shapes are also compared with the
    /// rows of one reversed; else 0.
    std::uint16_t reversibleRows;
    /// Rests on inside distances: signatures before version 4 have none that can be compared.
    bool ofPaths;
};

constexpr std::array<StatisticLayout, kStatisticKinds> kStatistics{{
    {"chords", 0, 48, Evidence::kSurface, 0, false},
    {"thickness by centrality", 48, 60, Evidence::kInside, 0, true},
    {"thickness by radius", 108, 60, Evidence::kInside, 0, false},
    {"bending", 168, 24, Evidence::kInside, 0, true},
    {"interior harmonics", 192, 64, Evidence::kInside, 0, false},
    {"surface distances", 256, 32, Evidence::kSurface, 0, false},
    {"surface harmonics", 288, 64, Evidence::kSurface, 0, false},
    {"spread", 352, 20, Evidence::kInside, 0, false},
    {"footprint", 372, 40, Evidence::kOutline, 10, false},
    {"footprint distances", 412, 20, Evidence::kOutline, 0, false},
    {"thickness change", 432, 16, Evidence::kInside, 0, true},
}};
constexpr std::size_t kStatisticBins = 448;
/// Without the last statistic, which versions 2 and 3 of the signature do not have. Persisted.
constexpr std::size_t kEarlierStatisticBins = 432;

/// The level of each bin, 0 to kTopLevel: the square root of its share of the whole, in steps. Two shapes are
/// compared by the L1 distance of these roots.
using ShapeStatistics = std::array<std::uint8_t, kStatisticBins>;

/// The same bits on any number of threads; uses up to three of the caller's arena. Errors: kCancelled,
/// kDeadlineExceeded.
[[nodiscard]] Result<ShapeStatistics> shapeStatistics(const InteriorView& view,
                                                      const RunContext& context = {});

}  // namespace shapedb
