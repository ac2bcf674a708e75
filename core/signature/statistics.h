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
};
constexpr std::size_t kStatisticKinds = 7;

struct StatisticLayout {
    const char* name;      ///< for people: "chords"; static storage
    std::uint16_t offset;  ///< of its first bin
    std::uint16_t count;   ///< bins
    /// False: the surface decides, so it holds for open scans too (a chord's share inside hardly
    /// depends on how thick a thin shape is taken to be).
    bool ofInterior;
};

constexpr std::array<StatisticLayout, kStatisticKinds> kStatistics{{
    {"chords", 0, 48, false},
    {"thickness by centrality", 48, 60, true},
    {"thickness by radius", 108, 60, true},
    {"bending", 168, 24, true},
    {"interior harmonics", 192, 64, true},
    {"surface distances", 256, 32, false},
    {"surface harmonics", 288, 64, false},
}};
constexpr std::size_t kStatisticBins = 352;

/// Each bin is the square root of its share of the whole, [0, 1], in steps of 1/255: differences
/// of roots weigh a rare bin that is there or not like a small change of a full one (Hellinger).
using ShapeStatistics = std::array<std::uint8_t, kStatisticBins>;

/// Deterministic. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<ShapeStatistics> shapeStatistics(const InteriorView& view,
                                                      const RunContext& context = {});

}  // namespace shapedb
