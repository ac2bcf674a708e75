// SPDX-License-Identifier: GPL-3.0-or-later
// What an interior costs by its boundary, and which of many nested interiors costs least.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"
#include "core/segmentation/inside_potential.h"

namespace shapedb {

/// An interior that separates a smaller fraction of the points than this has leaked out.
inline constexpr double kLeastSeparated = 0.35;

/// Area of a facet, and its circumradius in units of the mean spacing of its corners (infinite when its
/// corners are collinear).
struct FacetExtent {
    double area = 0.0;
    double width = 0.0;
};
[[nodiscard]] FacetExtent facetExtent(const PointCloud& points, const Tetrahedra& tetrahedra,
                                      std::size_t tetrahedron, std::size_t facet,
                                      const std::vector<double>& spacings);

/// What the cost of an interior is made of.
struct BoundaryMeasures {
    double separatedFraction = 0.0;  ///< of the points: those with the boundary between their two poles
    double bridged = 0.0;            ///< area of bridges over the area that the points stand for
    double covered = 0.0;            ///< fraction of the boundary's area that is not a bridge
};

/// The fraction of points on one side, plus half of the bridged area: never negative.
[[nodiscard]] double costOf(double separatedFraction, double bridged);

/// The interiors {t : level[t] >= threshold} for the thresholds in [low, high].
struct NestedInteriors {
    std::vector<double> level;  ///< per tetrahedron; minus infinity: never inside
    double low = 0.0;
    double high = 0.0;
    double preferred = 0.0;         ///< of the thresholds of one interior the nearest to this is taken
    double preferenceWeight = 0.0;  ///< what |log(threshold / preferred)| adds to the cost
};

[[nodiscard]] std::vector<std::uint8_t> interiorAt(const std::vector<double>& level, double threshold);

/// All thresholds in (above, upTo] cost the same.
struct CostStep {
    double above = 0.0;
    double upTo = 0.0;
    double separatedFraction = 0.0;
    double bridged = 0.0;
};

struct Threshold {
    double value = 0.0;
    double cost = 0.0;  ///< with the preference; infinite: none separates kLeastSeparated of the points
};

/// Measures interiors of one triangulation. Thread-safe.
class InteriorCost {
  public:
    InteriorCost(const PointCloud& points, const Tetrahedra& tetrahedra, const std::vector<double>& spacings);

    [[nodiscard]] BoundaryMeasures measure(const std::vector<std::uint8_t>& inside) const;

    /// The cost of the interior at every threshold above the least level, in ascending order without gaps.
    [[nodiscard]] std::vector<CostStep> steps(const std::vector<double>& level) const;

    /// The threshold that costs least; of equal ones the lowest.
    [[nodiscard]] Threshold best(const NestedInteriors& interiors) const;

    [[nodiscard]] const std::vector<Poles>& poles() const { return poles_; }

  private:
    struct Facet {
        std::uint32_t tetrahedron = 0;
        std::uint32_t next = kNoTetrahedron;
        double area = 0.0;
        bool bridge = false;
    };

    static std::vector<Facet> measureFacets(const PointCloud& points, const Tetrahedra& tetrahedra,
                                            const std::vector<double>& spacings);

    std::vector<Facet> facets_;
    std::vector<Poles> poles_;
    double pointArea_ = 0.0;
};

}  // namespace shapedb
