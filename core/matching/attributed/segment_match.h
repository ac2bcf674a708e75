// SPDX-License-Identifier: GPL-3.0-or-later
// How well the segments of two bodies agree: the best over all alignments of their weighted points
// (Section 4.2), where each point brings the attributes of its segment.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/motion.h"
#include "core/geometry/point.h"
#include "core/matching/attributed/segment_span.h"
#include "core/matching/score.h"

namespace shapedb {

/// Under an alignment that brings them to distance d, two segments are worth to each other
///   min(shares) * likeness of their sizes * (k(difference of radii) + k(d)) / 2
/// with k the kernel of kernel.h: one half wherever the limb points (pose), the other half only where
/// it lies on its counterpart. Each segment of either side counts with its best counterpart;
/// `agreement` is the mean of both sides, in [0, 1].
struct SegmentMatch {
    double agreement = 0.0;
    Matrix3 rotation = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< frame of b to frame of a
    bool reflected = false;
};

/// How alike two segments are in size, [0, 1]: the kernel, half an octave wide, of the root mean square
/// difference of their four logarithmic sizes, where q is expected to be `octavesLarger`.
[[nodiscard]] double sizeLikeness(const SegmentDescriptor& p, const SegmentDescriptor& q,
                                  double octavesLarger = 0.0);

/// Segments less alike (in size and place) than this start no alignment of their own.
constexpr double kAlikeEnough = 0.4;

/// A segment of a and one of b, and what the two add to the agreement.
struct SegmentPair {
    std::uint8_t a = 0;
    std::uint8_t b = 0;
    double gain = 0.0;
    double distance = 0.0;  ///< under the alignment, in units of the scale
};
struct SegmentPairs {
    std::array<SegmentPair, 2 * kMaxSignaturePoints> pairs;
    std::size_t count = 0;
};

/// Two bodies to be compared, with what no alignment changes computed once: the bound, the match and
/// its pairs share it. Some 5 KB, for the stack. Keeps views of both bodies.
class SegmentComparison {
  public:
    /// `options`: reflection, kernelWidth.
    SegmentComparison(SegmentSpan a, SegmentSpan b, const ScoreOptions& options);

    /// Never below the agreement of `match`: no motion brings two segments nearer than their radii
    /// differ.
    [[nodiscard]] double agreementBound() const;

    /// The best alignment, with origin on origin: the axes of the two frames on each other with either
    /// sign, and the heaviest outlying segments of a on segments of b like them. `prune` stops where
    /// the bound is reached; it does not change the result.
    [[nodiscard]] SegmentMatch match(bool prune = true) const;

    /// Which segments meet under `match`; the gains sum to its agreement.
    [[nodiscard]] SegmentPairs pairs(const SegmentMatch& match) const;

  private:
    class Search;
    using Row = std::array<double, kMaxSignaturePoints>;
    using Positions = std::array<Point3, kMaxSignaturePoints>;

    [[nodiscard]] Positions rotatedB(const Matrix3& rotation) const;
    [[nodiscard]] double gain(std::size_t i, std::size_t j, const Positions& rotated) const;
    [[nodiscard]] double agreementUnder(const Matrix3& rotation) const;

    SegmentSpan a_, b_;
    bool reflection_;
    double kernelWidth_;
    Positions positionA_, positionB_;
    std::array<Row, kMaxSignaturePoints> worth_;     // min(shares) * likeness of sizes / 2
    std::array<Row, kMaxSignaturePoints> radially_;  // kernel of the difference of radii
    double most_;                                    // bound of the agreement, before it is cut off at 1
};

// Frames from two directions, and the orthogonal map between two of them.

/// Right-handed, orthonormal.
using Tripod = std::array<Point3, 3>;

/// A vector shorter than this, in units of a body's size, has no reliable direction.
constexpr double kShortestDirection = 1e-3;

/// First axis along `first`, second in the half plane of `second`. False, and `out` undefined, when
/// `first`, or the component of `second` across it, is shorter than kShortestDirection.
[[nodiscard]] bool tripod(const Point3& first, const Point3& second, Tripod& out);

/// Maps each axis of `from` to that of `to`; reflected: the third axis to the opposite.
[[nodiscard]] Matrix3 tripodMap(const Tripod& from, const Tripod& to, bool reflected);

}  // namespace shapedb
