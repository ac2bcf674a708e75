#include "server/catalog/searches.h"

#include <utility>

#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/matching/scorer.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

Result<void> AnswerRoom::take(std::size_t bytes) {
    if (bytes > left_) {
        return fail(ErrorCode::kInvalidArgument,
                    "the answer would exceed " + std::to_string(kMaxAnswerBytes) +
                        " bytes; ask for a smaller k or fewer queries, or set no_explanation");
    }
    left_ -= bytes;
    return {};
}

Result<PreparedSearch> Searches::prepare(index::SnapshotPtr collection, const SearchRequest& request) const {
    RETURN_IF_ERROR(checkK(request.k, maxK_));
    RETURN_IF_ERROR(checkThreshold(request.threshold));
    RETURN_IF_ERROR(checkFilterLength(request.filter));
    Result<Filter> filter = Filter::parse(request.filter);
    RETURN_IF_ERROR(filter);
    PreparedSearch prepared;
    prepared.collection = std::move(collection);
    prepared.options.k = request.k;
    prepared.options.threshold = request.threshold;
    prepared.options.filter = std::move(*filter);
    prepared.options.score = request.score;
    prepared.explain = request.explain;
    return prepared;
}

Result<BatchQuery> Searches::storedQuery(const PreparedSearch& search, const std::string& key,
                                         bool includeSelf) const {
    const auto found = catalog_.findShape(search.collection, key);
    RETURN_IF_ERROR(found);
    auto signature = catalog_.signature(*found);
    RETURN_IF_ERROR(signature);
    BatchQuery query{std::move(*signature), std::nullopt};
    if (!includeSelf) query.excludeId = found->shape.id;
    return query;
}

Result<BatchQuery> Searches::query(const PreparedSearch& search, const QuerySource& source) const {
    if (source.key && source.signature) {
        return fail(ErrorCode::kInvalidArgument, "both key and signature are set: leave one out");
    }
    if (source.key) return storedQuery(search, *source.key);
    if (!source.signature) return fail(ErrorCode::kInvalidArgument, "neither key nor signature is set");
    auto signature = decodeSignature(*source.signature);
    RETURN_IF_ERROR(signature);
    return BatchQuery{std::move(*signature), std::nullopt};
}

Result<Signature> Searches::compared(const char* which, const ShapeName& name) const {
    const auto signatureOf = [&]() -> Result<Signature> {
        const auto collection = catalog_.collection(name.collection);
        RETURN_IF_ERROR(collection);
        const auto found = catalog_.findShape(*collection, name.key);
        RETURN_IF_ERROR(found);
        return catalog_.signature(*found);
    };
    auto signature = signatureOf();
    if (!signature) return fail(withContext(signature.error(), which + std::string(": ")));
    return signature;
}

Result<Comparison> Searches::compare(const ShapeName& query, const ShapeName& other,
                                     const ScoreOptions& options) const {
    auto first = compared("query", query);
    RETURN_IF_ERROR(first);
    auto second = compared("other", other);
    RETURN_IF_ERROR(second);
    Explanation explanation = shapedb::explain(*first, *second, options);
    return Comparison{std::move(*first), std::move(*second), std::move(explanation)};
}

Error ofQuery(std::size_t i, Error error) {
    return withContext(std::move(error), "query " + std::to_string(i) + ": ");
}

Result<std::vector<BatchQuery>> Searches::queries(const PreparedSearch& search,
                                                  const std::vector<QuerySource>& sources) const {
    std::vector<BatchQuery> queries;
    queries.reserve(sources.size());
    for (const QuerySource& source : sources) {
        auto one = query(search, source);
        if (!one) return fail(ofQuery(queries.size(), one.error()));
        queries.push_back(std::move(*one));
    }
    return queries;
}

Result<SearchResult> Searches::run(const PreparedSearch& search, const BatchQuery& query,
                                   const RunContext& context) const {
    SearchOptions options = search.options;
    options.excludeId = query.excludeId;
    return runner_.run(query.signature, search.collection->signatures, options, context);
}

Result<ScanSearch> Searches::byScan(const PreparedSearch& search, const store::VerifiedScan& scan,
                                    const RunContext& context) const {
    const auto describe = [&] {
        SegmentationSlots::Slot slot(catalog_.segmentationSlots());
        return catalog_.describe(slot, scan, search.collection->parameters, context);
    };
    auto description = describe();
    RETURN_IF_ERROR(description);
    auto found = runner_.run(description->signature, search.collection->signatures, search.options, context);
    RETURN_IF_ERROR(found);
    return ScanSearch{std::move(*description), std::move(*found)};
}

Result<std::vector<SearchResult>> Searches::runBatch(const PreparedSearch& search,
                                                     const std::vector<BatchQuery>& queries,
                                                     const RunContext& context) const {
    return runner_.runBatch(queries, search.collection->signatures, search.options, context);
}

Result<std::optional<Explanation>> Searches::explain(const PreparedSearch& search, const Scorer& scorer,
                                                     const SearchHit& hit) const {
    const auto signature = catalog_.storedSignature(*search.collection, hit.id);
    if (!signature && signature.error().code == ErrorCode::kDataLoss) return fail(signature.error());
    // Deleted or replaced since the search, or not readable now: a hit without reasons.
    if (!signature) return std::optional<Explanation>();
    Explanation explanation = scorer.explain(*signature);
    // The shape has got another signature since the search.
    if (explanation.score != hit.score) return std::optional<Explanation>();
    return std::optional<Explanation>(std::move(explanation));
}

Result<void> Searches::visitHits(const PreparedSearch& search, const SearchResult& found,
                                 const Visit& visit) const {
    for (const SearchHit& hit : found.hits) {
        auto shape = catalog_.shapeById(hit.id);
        if (!shape && shape.error().code == ErrorCode::kNotFound) continue;  // deleted meanwhile
        RETURN_IF_ERROR(shape);
        FoundHit out;
        out.shape = std::move(*shape);
        out.quality = qualityIn(search.collection->signatures, hit.id);
        out.score = hit.score;
        if (search.explain) {
            auto explanation = explain(search, *found.scorer, hit);
            RETURN_IF_ERROR(explanation);
            out.explanation = std::move(*explanation);
        }
        RETURN_IF_ERROR(visit(out));
    }
    return {};
}

}  // namespace shapedb::catalog
