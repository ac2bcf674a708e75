// What a shape's interior and surface say as a whole: histograms that no rotation, reflection,
// translation or scale changes, and that bending changes little. They go beyond the paper, whose
// points and weights alone are a weak signature; docs/signature.md gives the reasons and figures.
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
    kChords,                 ///< straight lines between surface points: length by share inside
    kThicknessByCentrality,  ///< local thickness (circumradius) by mean inner distance to the rest
    kThicknessByRadius,      ///< local thickness by distance from the centroid
    kBending,                ///< straight distances in units of the mean inner distance
    kInteriorHarmonics,      ///< spherical-harmonic energies of the interior in shells
    kSurfaceDistances,       ///< distances between surface points (D2), in units of the size
    kSurfaceHarmonics,       ///< as the interior's, of the surface points
    kSpread,                 ///< rod, sheet or body: spread of the surface around its points
    kFootprint,              ///< the outline: place along it by distance from its long axis
    kFootprintDistances,     ///< distances between points of the outline, in units of its length
};
constexpr std::size_t kStatisticKinds = 10;

/// What a scan must show for a statistic of it to hold.
enum class Evidence : std::uint8_t {
    kInside,   ///< all of the surface, so that the inside can be told
    kSurface,  ///< the surface; of one side most of it holds (a chord's share inside hardly depends
               ///< on how thick a thin shape is taken to be)
    kOutline,  ///< one side, seen as it lies
};

struct StatisticLayout {
    const char* name;      ///< for people: "chords"; static storage
    std::uint16_t offset;  ///< of its first bin
    std::uint16_t count;   ///< bins
    Evidence evidence;
    /// Above 0: which end comes first is chance, so two shapes are also compared with one's rows in
    /// reverse; as many rows as this.
    std::uint16_t reversibleRows;
};

constexpr std::array<StatisticLayout, kStatisticKinds> kStatistics{{
    {"chords", 0, 48, Evidence::kSurface, 0},
    {"thickness by centrality", 48, 60, Evidence::kInside, 0},
    {"thickness by radius", 108, 60, Evidence::kInside, 0},
    {"bending", 168, 24, Evidence::kInside, 0},
    {"interior harmonics", 192, 64, Evidence::kInside, 0},
    {"surface distances", 256, 32, Evidence::kSurface, 0},
    {"surface harmonics", 288, 64, Evidence::kSurface, 0},
    {"spread", 352, 20, Evidence::kInside, 0},
    {"footprint", 372, 40, Evidence::kOutline, 10},
    {"footprint distances", 412, 20, Evidence::kOutline, 0},
}};
constexpr std::size_t kStatisticBins = 432;

/// The level (0 to kTopLevel) of each bin, a step of the square root of its share of the whole:
/// differences of roots weigh a rare bin that is there or not like a small change of a full one
/// (Hellinger).
using ShapeStatistics = std::array<std::uint8_t, kStatisticBins>;

/// Deterministic, with the same bits on any number of threads: takes up to three of the calling thread's
/// oneTBB arena. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<ShapeStatistics> shapeStatistics(const InteriorView& view,
                                                      const RunContext& context = {});

}  // namespace shapedb
