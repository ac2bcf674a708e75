// How well the parts of two bodies agree: the best over all alignments of their weighted points
// (Section 4.2), where each point brings the attributes of its segment.
#pragma once

#include <array>
#include <cstdint>

#include "core/matching/score.h"
#include "core/signature/segment_descriptor.h"

namespace shapedb {

/// What two parts are worth to each other under an alignment that brings them to distance d:
///   min(shares) * likeness of their sizes * (k(difference of radii) + k(d)) / 2
/// with k the kernel of alignment.h. Half is due wherever the limb points (pose), half only where it
/// lies on its counterpart. Each part of either side counts with its best counterpart;
/// `agreement` is the mean of both sides, in [0, 1].
struct SegmentMatch {
    double agreement = 0.0;
    Matrix3 rotation = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< frame of b to frame of a
    bool reflected = false;
};

/// How alike two parts are in size, [0, 1]: the kernel of the root mean square difference of their
/// four logarithmic sizes, of width half an octave, where q is expected to be `octavesLarger`.
[[nodiscard]] double sizeLikeness(const SegmentDescriptor& p, const SegmentDescriptor& q,
                                  double octavesLarger = 0.0);

/// Parts whose likeness (and place) is below this lead no alignment of their own.
constexpr double kAlikeEnough = 0.4;

/// The best alignment: with origin on origin, the axes of the two frames on each other in every
/// sense, and the heaviest outlying parts of a on parts of b like them. `options`: reflection,
/// kernelWidth. `prune` stops an alignment that cannot win and changes nothing.
[[nodiscard]] SegmentMatch matchSegments(const Body& a, const Body& b, const ScoreOptions& options,
                                         bool prune = true);

/// Never below matchSegments(a, b, options).agreement: no motion brings two parts nearer than their
/// radii differ.
[[nodiscard]] double segmentAgreementBound(const Body& a, const Body& b, const ScoreOptions& options);

/// SegmentDescriptor of a and part of b, and what they add to the agreement.
struct SegmentPair {
    std::uint8_t a = 0;
    std::uint8_t b = 0;
    double gain = 0.0;
    double distance = 0.0;  ///< under the alignment, units of the scale
};
struct SegmentPairs {
    std::array<SegmentPair, 2 * kMaxSignaturePoints> pairs;
    std::size_t count = 0;
};

/// Who met whom under `match`; the gains sum to its agreement.
[[nodiscard]] SegmentPairs segmentPairs(const Body& a, const Body& b, const SegmentMatch& match,
                                        const ScoreOptions& options);

}  // namespace shapedb
