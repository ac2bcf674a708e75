#include "core/matching/score.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/geometry/axis.h"
#include "core/matching/attributed/attribute_score.h"
#include "core/matching/attributed/containment.h"
#include "core/matching/attributed/segment_match.h"
#include "core/matching/published/alignment.h"

namespace shapedb {

namespace {

bool canonicalLess(const ShapeAttributes& a, const ShapeAttributes& b) {
    if (a.body.parts.size() != b.body.parts.size()) return a.body.parts.size() < b.body.parts.size();
    for (std::size_t i = 0; i < a.body.parts.size(); ++i) {
        const SegmentDescriptor& p = a.body.parts[i];
        const SegmentDescriptor& q = b.body.parts[i];
        if (p.share != q.share) return p.share < q.share;
        if (p.position != q.position) return p.position < q.position;
        if (p.size != q.size) return p.size < q.size;
    }
    if (a.quality != b.quality) return a.quality < b.quality;
    return a.statistics < b.statistics;
}

// An order on what is scored, so that score(a, b) and score(b, a) are one computation.
bool canonicalLess(const Signature& a, const Signature& b) {
    if (a.attributes && b.attributes) return canonicalLess(*a.attributes, *b.attributes);
    if (a.points.size() != b.points.size()) return a.points.size() < b.points.size();
    for (std::size_t i = 0; i < a.points.size(); ++i) {
        const WeightedPoint& p = a.points[i];
        const WeightedPoint& q = b.points[i];
        if (p.weight != q.weight) return p.weight < q.weight;
        if (p.position != q.position) return p.position < q.position;
    }
    return a.scale < b.scale;
}

struct Scaled {
    AnchoredPoints a, b;
};

// Length 1 of `of` in the unit in which it is compared with `other`: its own scale, or, where
// sizes count, the larger scale of the two.
double inCommonUnit(const Signature& of, const Signature& other, const ScoreOptions& options) {
    return options.keepScale ? of.scale / std::max(of.scale, other.scale) : 1.0;
}

Scaled inCommonScale(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return {anchoredPoints(a, inCommonUnit(a, b, options)), anchoredPoints(b, inCommonUnit(b, a, options))};
}

bool identical(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return sameShape(a, b) && (!options.keepScale || a.scale == b.scale);
}

bool bothAttributed(const Signature& a, const Signature& b) {
    return a.attributes.has_value() && b.attributes.has_value();
}

// Only a shape itself scores 1, however little another differs.
double belowOne(double score) { return std::min(score, std::nextafter(1.0, 0.0)); }

double attributedScore(const Signature& a, const Signature& b, double agreement,
                       const ScoreOptions& options) {
    return belowOne(attributeScore(attributeDistance(a, b, options), agreement));
}

bool isDegenerate(const Signature& a, const Signature& b) {
    return a.points.size() == 1 || b.points.size() == 1;
}

// similarity / (similarity + dissimilarity), clamped against rounding.
double ratio(double similarity, const AnchoredPoints& a, const AnchoredPoints& b) {
    const double whole = a.totalWeight + b.totalWeight - similarity;
    return std::clamp(similarity / whole, 0.0, 1.0);
}

double finalScore(double similarity, const Scaled& scaled, const Signature& a, const Signature& b,
                  const ScoreOptions& options) {
    if (identical(a, b, options)) return 1.0;
    const double value = options.partial ? belowOne(std::min(1.0, similarity / scaled.a.totalWeight))
                                         : ratio(similarity, scaled.a, scaled.b);
    return isDegenerate(a, b) ? std::min(value, kDegenerateCeiling) : value;
}

// The most each point of one side could gain, whatever the motion.
double similarityBound(const AnchoredPoints& a, const AnchoredPoints& b, double width) {
    double sum = 0.0;
    std::array<double, kMaxSignaturePoints> radiusB;
    for (std::size_t q = 0; q < b.count; ++q) radiusB[q] = length(b.position[q]);
    for (std::size_t p = 0; p < a.count; ++p) {
        const double radius = length(a.position[p]);
        double best = 0.0;
        for (std::size_t q = 0; q < b.count; ++q) {
            const double gap = leastGap(radius, radiusB[q]);
            best = std::max(best, std::min(a.weight[p], b.weight[q]) * kernel(gap * gap, width));
        }
        sum += best;
    }
    return sum;
}

std::vector<std::uint32_t> missing(std::size_t count, const std::vector<PointMatch>& matches,
                                   std::uint32_t PointMatch::*side) {
    std::vector<bool> seen(count, false);
    for (const PointMatch& match : matches) seen[match.*side] = true;
    std::vector<std::uint32_t> rest;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!seen[i]) rest.push_back(i);
    }
    return rest;
}

// Scan coordinates of b to scan coordinates of a, from a rotation of normalised positions.
Motion scanMotion(const Signature& a, const Signature& b, const ScoreOptions& options,
                  const Matrix3& rotation, bool reflected) {
    Motion motion;
    motion.scale = options.keepScale ? 1.0 : a.scale / b.scale;
    motion.rotation = rotation;
    motion.reflected = reflected;
    motion.translation = a.origin - motion.scale * rotate(rotation, b.origin);
    return motion;
}

// Scan coordinates of b to scan coordinates of a, from frame of b to frame of a.
Motion bodyMotion(const Signature& a, const Signature& b, const ScoreOptions& options,
                  const SegmentMatch& match) {
    const Body& from = b.attributes->body;
    const Body& to = a.attributes->body;
    Motion motion;
    motion.scale = options.keepScale ? 1.0 : a.scale / b.scale;
    motion.reflected = match.reflected;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            double sum = 0.0;
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    sum += to.axes[i][row] * match.rotation[i][j] * from.axes[j][column];
                }
            }
            motion.rotation[row][column] = sum;
        }
    }
    const Point3 centreA = a.origin + a.scale * to.centre;
    const Point3 centreB = b.origin + b.scale * from.centre;
    motion.translation = centreA - motion.scale * rotate(motion.rotation, centreB);
    return motion;
}

// The scale of b's lengths against a's when sizes are kept, else 0: to be found.
double knownScale(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return options.keepScale ? a.scale / b.scale : 0.0;
}

double partialScore(const Signature& a, const Signature& b, double agreement, double share,
                    const ScoreOptions& options) {
    if (identical(a, b, options)) return 1.0;
    return belowOne(pieceScore(attributeDistance(a, b, options), agreement, share));
}

// Symmetric bit for bit, as `score` makes it.
double agreementOf(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const bool swapped = canonicalLess(b, a);
    return matchSegments((swapped ? b : a).attributes->body, (swapped ? a : b).attributes->body, options)
        .agreement;
}

// Scan coordinates of b (the whole) to scan coordinates of a (the piece).
Motion pieceMotion(const Signature& a, const Signature& b, const ScoreOptions& options,
                   const Containment& found) {
    SegmentMatch turn;
    turn.rotation = found.rotation;
    turn.reflected = found.reflected;
    Motion motion = bodyMotion(a, b, options, turn);
    const double s = a.scale / b.scale / found.scale;
    motion.scale = options.keepScale ? 1.0 : s;
    const auto inScan = [](const Signature& of, const Point3& inFrame) {
        const Body& body = of.attributes->body;
        Point3 p = body.centre;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            p = p + coordinate(inFrame, axis) *
                        Point3{body.axes[axis][0], body.axes[axis][1], body.axes[axis][2]};
        }
        return of.origin + of.scale * p;
    };
    motion.translation = inScan(a, found.to) - motion.scale * rotate(motion.rotation, inScan(b, found.from));
    return motion;
}

void addPairs(const SegmentPairs& pairs, double total, const Signature& a, const Signature& b,
              Explanation& result) {
    for (std::size_t i = 0; i < pairs.count; ++i) {
        const SegmentPair& pair = pairs.pairs[i];
        result.matches.push_back({pair.a, pair.b, pair.gain / total, pair.distance});
    }
    std::sort(result.matches.begin(), result.matches.end(), [](const PointMatch& x, const PointMatch& y) {
        if (x.share != y.share) return x.share > y.share;
        return x.a != y.a ? x.a < y.a : x.b < y.b;
    });
    result.unmatchedA = missing(a.points.size(), result.matches, &PointMatch::a);
    result.unmatchedB = missing(b.points.size(), result.matches, &PointMatch::b);
}

Explanation explainPartial(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const Body& piece = a.attributes->body;
    const Body& whole = b.attributes->body;
    const Containment found = containment(piece, whole, knownScale(a, b, options), options);
    Explanation result;
    const double agreement = agreementOf(a, b, options);
    result.score = partialScore(a, b, agreement, found.share, options);
    result.similarity = found.share;
    result.dissimilarity = 1.0 - found.share;
    result.degenerate = isDegenerate(a, b);
    result.motion = pieceMotion(a, b, options, found);
    result.terms = pieceTerms(a, b, options, agreement, found.share);
    addPairs(containedPairs(piece, whole, found, options), found.share, a, b, result);
    return result;
}

Explanation explainAttributed(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const Body& bodyA = a.attributes->body;
    const Body& bodyB = b.attributes->body;
    const SegmentMatch match = matchSegments(bodyA, bodyB, options);
    Explanation result;
    result.score = identical(a, b, options) ? 1.0 : attributedScore(a, b, match.agreement, options);
    result.similarity = match.agreement;
    result.dissimilarity = std::max(0.0, 1.0 - match.agreement);
    result.degenerate = isDegenerate(a, b);
    result.motion = bodyMotion(a, b, options, match);
    result.terms = scoreTerms(a, b, options, match.agreement);
    addPairs(segmentPairs(bodyA, bodyB, match, options), match.agreement, a, b, result);
    return result;
}

Explanation explainOrdered(const Signature& a, const Signature& b, const ScoreOptions& options) {
    if (bothAttributed(a, b)) return explainAttributed(a, b, options);
    const Scaled scaled = inCommonScale(a, b, options);
    const BestAlignment best = bestAlignment(scaled.a, scaled.b, options);
    Explanation result;
    result.score = finalScore(best.matches.similarity, scaled, a, b, options);
    result.similarity = best.matches.similarity;
    result.dissimilarity =
        std::max(0.0, scaled.a.totalWeight + scaled.b.totalWeight - 2.0 * best.matches.similarity);
    result.degenerate = isDegenerate(a, b);
    result.motion = scanMotion(a, b, options, alignmentRotation(scaled.a, scaled.b, best.alignment),
                               best.alignment.reflected);
    for (std::size_t i = 0; i < best.matches.count; ++i) {
        const PairList::Pair& pair = best.matches.pairs[i];
        result.matches.push_back({pair.a, pair.b, pair.gain / best.matches.similarity,
                                  std::sqrt(pair.squaredDistance) / inCommonUnit(a, b, options)});
    }
    result.unmatchedA = missing(a.points.size(), result.matches, &PointMatch::a);
    result.unmatchedB = missing(b.points.size(), result.matches, &PointMatch::b);
    return result;
}

}  // namespace

Result<void> validate(const ScoreOptions& options) {
    if (options.kernelWidth >= kMinKernelWidth && options.kernelWidth <= kMaxKernelWidth) return {};
    std::ostringstream message;
    message << "kernel_width is " << options.kernelWidth << "; it must be " << kMinKernelWidth << " to "
            << kMaxKernelWidth;
    return fail(ErrorCode::kInvalidArgument, message.str());
}

double score(const Signature& a, const Signature& b, const ScoreOptions& options) {
    if (identical(a, b, options)) return 1.0;
    if (options.partial && bothAttributed(a, b)) {
        const double scale = knownScale(a, b, options);
        const Containment found = containment(a.attributes->body, b.attributes->body, scale, options);
        return partialScore(a, b, agreementOf(a, b, options), found.share, options);
    }
    if (canonicalLess(b, a) && !options.partial) return score(b, a, options);
    if (bothAttributed(a, b)) {
        const SegmentMatch match = matchSegments(a.attributes->body, b.attributes->body, options);
        return attributedScore(a, b, match.agreement, options);
    }
    const Scaled scaled = inCommonScale(a, b, options);
    return finalScore(bestAlignment(scaled.a, scaled.b, options).matches.similarity, scaled, a, b, options);
}

double scoreUpperBound(const Signature& a, const Signature& b, const ScoreOptions& options) {
    if (identical(a, b, options)) return 1.0;
    if (bothAttributed(a, b)) {
        const bool swapped = canonicalLess(b, a);
        const Body& first = (swapped ? b : a).attributes->body;
        const Body& second = (swapped ? a : b).attributes->body;
        const double agreement = segmentAgreementBound(first, second, options);
        if (!options.partial) return attributedScore(a, b, agreement, options);
        const double share =
            containmentBound(a.attributes->body, b.attributes->body, knownScale(a, b, options));
        return partialScore(a, b, agreement, share, options);
    }
    const Scaled scaled = inCommonScale(a, b, options);
    const double most = std::min({similarityBound(scaled.a, scaled.b, options.kernelWidth),
                                  similarityBound(scaled.b, scaled.a, options.kernelWidth)}) *
                        kBoundMargin;
    const double whole = options.partial ? scaled.a.totalWeight
                                         : std::max(most, scaled.a.totalWeight + scaled.b.totalWeight - most);
    const double bound = std::min(1.0, most / whole * kBoundMargin);
    return isDegenerate(a, b) ? std::min(bound, kDegenerateCeiling) : bound;
}

Explanation explain(const Signature& a, const Signature& b, const ScoreOptions& options) {
    if (options.partial && bothAttributed(a, b)) return explainPartial(a, b, options);
    if (options.partial || !canonicalLess(b, a)) return explainOrdered(a, b, options);
    Explanation result = explainOrdered(b, a, options);
    result.motion = inverse(result.motion);
    // Distances so far are in units of b's scale; parts are compared each in its own.
    const double unit =
        bothAttributed(a, b) ? 1.0 : inCommonUnit(b, a, options) / inCommonUnit(a, b, options);
    for (PointMatch& match : result.matches) {
        std::swap(match.a, match.b);
        match.distance *= unit;
    }
    std::swap(result.unmatchedA, result.unmatchedB);
    return result;
}

}  // namespace shapedb
