// SPDX-License-Identifier: GPL-3.0-or-later
// The best of all alignments of two weighted point sets (Section 4.2).
//
// An alignment puts the heaviest points (the anchors) on each other and turns b so that the axis from
// its anchor to one of its points j lies on the axis from a's anchor to one of its points i. In space
// this leaves the roll about the axis free, on which the paper is silent: a second pair (k, l) fixes
// it, whose directions away from the axis are made to agree. Each is tried with and without a
// reflection.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/motion.h"
#include "core/matching/score.h"
#include "core/matching/shape_row.h"

namespace shapedb {

/// A weighted point set in the scale in which two shapes are compared.
struct AnchoredPoints {
    std::size_t count = 0;
    std::array<Point3, kMaxSignaturePoints> position;  ///< the anchor, first, is the origin
    std::array<double, kMaxSignaturePoints> weight{};  ///< falling
    double totalWeight = 0.0;
};

/// `factor` scales lengths (and weights by its cube): 1 keeps the normalised points.
[[nodiscard]] AnchoredPoints anchoredPoints(const ShapeRow& shape, double factor);

/// Which points match, as indices into the two sets.
struct PairList {
    struct Pair {
        std::uint8_t a = 0;
        std::uint8_t b = 0;
        double gain = 0.0;  ///< min(weights) * kernel(distance)
        double squaredDistance = 0.0;
    };
    std::array<Pair, kMaxSignaturePoints> pairs;
    std::size_t count = 0;
    double similarity = 0.0;  ///< sum of the gains
};

/// One alignment: the axes through a's point i and b's point j, rolled so that b's point l points the
/// way a's point k does. k = l = 0: all points of one side lie on the axis, and any roll will do.
/// i = j = 0: one side has no axis; no rotation at all.
struct Alignment {
    std::uint8_t i = 0, j = 0, k = 0, l = 0;
    bool reflected = false;  ///< b is mirrored before it is turned
};

struct BestAlignment {
    Alignment alignment;
    PairList matches;
};

/// The alignment with the largest similarity. Axis pairs are tried in descending order of bound; of equal
/// ones the first wins. `prune` stops where no bound can beat the best so far; it does not change the result.
[[nodiscard]] BestAlignment bestAlignment(const AnchoredPoints& a, const AnchoredPoints& b,
                                          const ScoreOptions& options, bool prune = true);

/// The rotation (determinant -1 when reflected) that takes positions of b to positions of a.
[[nodiscard]] Matrix3 alignmentRotation(const AnchoredPoints& a, const AnchoredPoints& b,
                                        const Alignment& alignment);

}  // namespace shapedb
