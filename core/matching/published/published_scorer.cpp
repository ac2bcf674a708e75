// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/published/published_scorer.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/matching/kernel.h"
#include "core/matching/published/alignment.h"

namespace shapedb {

namespace {

// Length 1 of `of` in the unit in which it is compared with `other`: its own scale, or, where sizes
// count, the larger scale of the two.
double inCommonUnit(const ShapeRow& of, const ShapeRow& other, const ScoreOptions& options) {
    return options.keepScale ? of.scale / std::max(of.scale, other.scale) : 1.0;
}

struct CommonScale {
    CommonScale(const ShapeRow& rowA, const ShapeRow& rowB, const ScoreOptions& options)
        : a(anchoredPoints(rowA, inCommonUnit(rowA, rowB, options))),
          b(anchoredPoints(rowB, inCommonUnit(rowB, rowA, options))) {}

    AnchoredPoints a, b;
};

// The most each point of one side could gain: a motion about the anchor keeps distances from it, so at best a
// point meets one of the other side at its own distance.
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

bool isDegenerate(const ShapeRow& a, const ShapeRow& b) { return a.pointCount == 1 || b.pointCount == 1; }

double underCeiling(double score, const ShapeRow& a, const ShapeRow& b) {
    return isDegenerate(a, b) ? std::min(score, kDegenerateCeiling) : score;
}

class PublishedScorer : public Scorer {
  public:
    PublishedScorer(const Signature& query, const ScoreOptions& options)
        : query_(query), options_(options), anchored_(anchoredPoints(query_.row(), 1.0)) {}

    bool compares(const ShapeRow& shape) const final { return shape.pointCount > 0; }

    double score(const ShapeRow& shape) const final {
        const ShapeRow query = query_.row();
        if (sameShape(query, shape, options_.keepScale)) return 1.0;
        const bool exchange = exchanges(query, shape);
        std::optional<AnchoredPoints> rescaled;
        const AnchoredPoints& own = anchoredQuery(shape, rescaled);
        const AnchoredPoints other = anchoredPoints(shape, inCommonUnit(shape, query, options_));
        const AnchoredPoints& a = exchange ? other : own;
        const AnchoredPoints& b = exchange ? own : other;
        const double similarity = bestAlignment(a, b, options_).matches.similarity;
        return underCeiling(ratio(similarity, a, b), query, shape);
    }

    double bound(const ShapeRow& shape) const final {
        const ShapeRow query = query_.row();
        if (sameShape(query, shape, options_.keepScale)) return 1.0;
        // Not exchanged: a bound need not have the same bits both ways.
        std::optional<AnchoredPoints> rescaled;
        const AnchoredPoints& a = anchoredQuery(shape, rescaled);
        const AnchoredPoints b = anchoredPoints(shape, inCommonUnit(shape, query, options_));
        // Pairs are one to one, so the points of either side bound the sum.
        const double most = std::min(similarityBound(a, b, options_.kernelWidth),
                                     similarityBound(b, a, options_.kernelWidth)) *
                            kBoundMargin;
        const double value = std::min(1.0, most / leastWhole(most, a, b) * kBoundMargin);
        return underCeiling(value, query, shape);
    }

    Explanation explain(const ShapeRow& shape) const final {
        const ShapeRow query = query_.row();
        if (!exchanges(query, shape)) return explain(query, shape);
        // Distances come in units of b's scale.
        return exchanged(explain(shape, query),
                         inCommonUnit(shape, query, options_) / inCommonUnit(query, shape, options_));
    }

  protected:
    // The score of shapes that are not the same.
    virtual double ratio(double similarity, const AnchoredPoints& a, const AnchoredPoints& b) const = 0;
    // What a similarity of at most `most` is divided by, at least.
    virtual double leastWhole(double most, const AnchoredPoints& a, const AnchoredPoints& b) const = 0;
    // Whether `shape` takes the first place, so that both orders of a pair are one computation.
    virtual bool exchanges(const ShapeRow& query, const ShapeRow& shape) const = 0;

  private:
    // The query in the unit in which it is compared with `shape`; `rescaled` gives room where that is not
    // its own.
    const AnchoredPoints& anchoredQuery(const ShapeRow& shape,
                                        std::optional<AnchoredPoints>& rescaled) const {
        const double factor = inCommonUnit(query_.row(), shape, options_);
        if (factor == 1.0) return anchored_;
        return rescaled.emplace(anchoredPoints(query_.row(), factor));
    }

    Explanation explain(const ShapeRow& a, const ShapeRow& b) const {
        const CommonScale scaled(a, b, options_);
        const BestAlignment best = bestAlignment(scaled.a, scaled.b, options_);
        const double similarity = best.matches.similarity;
        Explanation result;
        result.score = sameShape(a, b, options_.keepScale)
                           ? 1.0
                           : underCeiling(ratio(similarity, scaled.a, scaled.b), a, b);
        result.similarity = similarity;
        result.dissimilarity = std::max(0.0, scaled.a.totalWeight + scaled.b.totalWeight - 2.0 * similarity);
        result.degenerate = isDegenerate(a, b);
        result.motion.scale = options_.keepScale ? 1.0 : a.scale / b.scale;
        result.motion.rotation = alignmentRotation(scaled.a, scaled.b, best.alignment);
        result.motion.reflected = best.alignment.reflected;
        result.motion.translation =
            a.placement->origin - result.motion.scale * rotate(result.motion.rotation, b.placement->origin);
        for (std::size_t i = 0; i < best.matches.count; ++i) {
            const PairList::Pair& pair = best.matches.pairs[i];
            result.matches.push_back({pair.a, pair.b, pair.gain / similarity,
                                      std::sqrt(pair.squaredDistance) / inCommonUnit(a, b, options_)});
        }
        listUnmatched(result, a.pointCount, b.pointCount);
        return result;
    }

    const PackedShape query_;
    const ScoreOptions options_;
    const AnchoredPoints anchored_;  ///< the query in its own scale
};

class PublishedWholeScorer final : public PublishedScorer {
  public:
    using PublishedScorer::PublishedScorer;

  protected:
    double ratio(double similarity, const AnchoredPoints& a, const AnchoredPoints& b) const override {
        const double whole = a.totalWeight + b.totalWeight - similarity;
        return std::clamp(similarity / whole, 0.0, 1.0);  // against rounding
    }
    double leastWhole(double most, const AnchoredPoints& a, const AnchoredPoints& b) const override {
        // The score rises with the similarity, and is cut off at 1.
        return std::max(most, a.totalWeight + b.totalWeight - most);
    }
    bool exchanges(const ShapeRow& query, const ShapeRow& shape) const override {
        return canonicalLess(shape, query);
    }
};

// The share of the query that finds its match.
class PublishedPartialScorer final : public PublishedScorer {
  public:
    using PublishedScorer::PublishedScorer;

  protected:
    double ratio(double similarity, const AnchoredPoints& a, const AnchoredPoints&) const override {
        return belowOne(std::min(1.0, similarity / a.totalWeight));
    }
    double leastWhole(double, const AnchoredPoints& a, const AnchoredPoints&) const override {
        return a.totalWeight;
    }
    bool exchanges(const ShapeRow&, const ShapeRow&) const override { return false; }
};

}  // namespace

std::unique_ptr<const Scorer> makePublishedScorer(const Signature& query, const ScoreOptions& options) {
    if (options.partial) return std::make_unique<PublishedPartialScorer>(query, options);
    return std::make_unique<PublishedWholeScorer>(query, options);
}

}  // namespace shapedb
