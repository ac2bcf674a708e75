// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/scorer.h"

#include <utility>

#include "core/matching/attributed/attributed_scorer.h"
#include "core/matching/published/published_scorer.h"

namespace shapedb {

namespace {

// A query with attributes among shapes of both kinds.
class MixedScorer final : public Scorer {
  public:
    MixedScorer(std::unique_ptr<const Scorer> attributed, std::unique_ptr<const Scorer> published)
        : attributed_(std::move(attributed)), published_(std::move(published)) {}

    bool compares(const ShapeRow& shape) const override { return of(shape).compares(shape); }
    double score(const ShapeRow& shape) const override { return of(shape).score(shape); }
    double bound(const ShapeRow& shape) const override { return of(shape).bound(shape); }
    Explanation explain(const ShapeRow& shape) const override { return of(shape).explain(shape); }

    void scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
              std::vector<Survivor>& left, ScanCounts& counts) const override {
        if (rows.attributedCount > 0) attributed_->scan(rows, wanted, least, left, counts);
        if (rows.attributedCount < rows.count) published_->scan(rows, wanted, least, left, counts);
    }

    std::optional<double> scoreIfReaches(const ShapeRow& shape, const Survivor& survivor,
                                         double least) const override {
        return of(shape).scoreIfReaches(shape, survivor, least);
    }

  private:
    const Scorer& of(const ShapeRow& shape) const { return shape.attributed() ? *attributed_ : *published_; }

    std::unique_ptr<const Scorer> attributed_;
    std::unique_ptr<const Scorer> published_;
};

}  // namespace

void Scorer::scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
                  std::vector<Survivor>& left, ScanCounts& counts) const {
    for (std::uint32_t row = 0; row < rows.count; ++row) {
        if (!wanted.empty() && wanted[row] == 0) continue;
        const ShapeRow shape = rows[row];
        if (!compares(shape)) continue;
        for (std::uint64_t& stage : counts.left) ++stage;
        const double most = bound(shape);
        if (most >= least) left.push_back({most, row, {}});
    }
}

std::optional<double> Scorer::scoreIfReaches(const ShapeRow& shape, const Survivor&, double) const {
    return score(shape);
}

Result<void> checkQuery(const Signature& query, std::size_t attributed) {
    if (query.attributes || attributed == 0) return {};
    return fail(ErrorCode::kInvalidArgument,
                "the query's signature has only points and weights, but those of the collection have "
                "attributes; make the query's signature with the collection's profile");
}

std::unique_ptr<const Scorer> makeScorer(const Signature& query, const ScoreOptions& options) {
    auto published = makePublishedScorer(query, options);
    if (!query.attributes) return published;
    return std::make_unique<MixedScorer>(makeAttributedScorer(query, options), std::move(published));
}

}  // namespace shapedb
