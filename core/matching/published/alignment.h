// All alignments of two weighted point sets (Section 4.2) and the best of them.
//
// An alignment lays the heaviest points (the anchors) on each other and turns b so that the
// axis from its anchor to one of its points j lies on the axis from a's anchor to one of its
// points i. In space this leaves a roll about the axis free, on which the paper is silent: it is
// fixed by a second pair (k, l) whose directions away from the axis are made to agree. Each is
// tried with and without a reflection.
#pragma once

#include <array>
#include <cstdint>

#include "core/matching/score.h"

namespace shapedb {

/// A weighted point set in the scale in which two are compared.
struct AnchoredPoints {
    std::size_t count = 0;
    std::array<Point3, kMaxSignaturePoints> position;  ///< the anchor, first, is the origin
    std::array<double, kMaxSignaturePoints> weight{};  ///< falling
    double totalWeight = 0.0;
};

/// `factor` scales lengths (weights by its cube): 1 leaves the normalised signature alone.
[[nodiscard]] AnchoredPoints anchoredPoints(const Signature& signature, double factor);

/// (1 - d^2 / (8 width^2))^4, 0 beyond; takes the squared distance.
[[nodiscard]] double kernel(double squaredDistance, double width);

/// A lower bound of |x - y| that holds after rounding too: how near two points at heights (or
/// radii) x and y can be brought by a motion that keeps these. What makes bounds safe to prune by.
[[nodiscard]] double leastGap(double x, double y);

/// Factor by which a bound is raised: room for the rounding of sums taken in another order.
constexpr double kBoundMargin = 1.0 + 1e-12;

/// Which points are laid on each other; indices into the two sets.
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

/// One alignment: the axes through a's point i and b's point j, rolled so that b's l faces as a's
/// k. k = l = 0: all points of one side lie on the axis, any roll does as well as another.
/// i = j = 0: one side has no axis; no turn at all.
struct Alignment {
    std::uint8_t i = 0, j = 0, k = 0, l = 0;
    bool reflected = false;  ///< b is mirrored before it is turned
};

struct BestAlignment {
    Alignment alignment;
    PairList matches;
};

/// The alignment with the largest similarity. Axis pairs are tried by falling bound; the first of
/// equals stays. `prune` stops where no bound can beat the best so far and changes nothing else.
[[nodiscard]] BestAlignment bestAlignment(const AnchoredPoints& a, const AnchoredPoints& b,
                                          const ScoreOptions& options, bool prune = true);

/// The rotation (determinant -1 when reflected) that takes positions of b to positions of a.
[[nodiscard]] Matrix3 alignmentRotation(const AnchoredPoints& a, const AnchoredPoints& b,
                                        const Alignment& alignment);

}  // namespace shapedb
