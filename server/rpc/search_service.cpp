#include "server/rpc/search_service.h"

#include <memory>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/matching/scorer.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"
#include "server/catalog/scan_upload.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/receive_scan.h"

namespace shapedb::rpc {
namespace {

/// The checked options of one request, and the snapshot that all its queries read.
struct Prepared {
    index::SnapshotPtr collection;
    SearchOptions options;
    bool explain = true;
};

Result<Prepared> prepare(const Services& services, Call& call, const pb::SearchOptions& options) {
    call.note({"k", std::uint64_t{options.k()}});
    const auto collection = call.collection(options.collection());
    RETURN_IF_ERROR(collection);
    RETURN_IF_ERROR(catalog::checkK(options.k(), services.config.limits.maxK));
    RETURN_IF_ERROR(catalog::checkThreshold(options.threshold()));
    RETURN_IF_ERROR(catalog::checkFilterLength(options.filter()));
    Result<Filter> filter = Filter::parse(options.filter());
    RETURN_IF_ERROR(filter);
    Prepared prepared;
    prepared.collection = *collection;
    prepared.options.k = options.k();
    prepared.options.threshold = options.threshold();
    prepared.options.filter = std::move(*filter);
    prepared.options.score.reflection = !options.forbid_reflection();
    prepared.options.score.keepScale = options.keep_scale();
    prepared.options.score.partial = options.partial();
    prepared.explain = !options.no_explanation();
    return prepared;
}

/// Leaves the explanation out where the scored signature has been replaced meanwhile.
Result<void> explainHit(const Services& services, const Prepared& prepared, const Scorer& scorer,
                        const SearchHit& hit, pb::Hit* out) {
    const auto signature = services.catalog.storedSignature(*prepared.collection, hit.id);
    if (!signature && signature.error().code == ErrorCode::kDataLoss) return fail(signature.error());
    if (!signature) return {};
    const Explanation explanation = scorer.explain(*signature);
    if (explanation.score == hit.score) toProto(explanation, out->mutable_explanation());
    return {};
}

/// Fills `response`. `room`: how many bytes the whole answer may still grow by.
Result<void> answer(const Services& services, const Prepared& prepared, const Signature& query,
                    const SearchResult& found, std::size_t& room, pb::SearchResponse* response) {
    response->set_candidates(found.counts.candidates);
    response->set_filtered(found.counts.filtered);
    response->set_scored(found.counts.scored);
    response->set_seconds_search(found.seconds);
    toProto(query, response->mutable_query());
    if (response->query().has_attributes()) {
        response->mutable_query()->mutable_attributes()->clear_statistics();
    }
    const std::unique_ptr<const Scorer> scorer = makeScorer(query, prepared.options.score);
    for (const SearchHit& hit : found.hits) {
        const auto shape = services.catalog.shapeById(hit.id);
        if (!shape && shape.error().code == ErrorCode::kNotFound) continue;  // deleted meanwhile
        RETURN_IF_ERROR(shape);
        pb::Hit* out = response->add_hits();
        toProto(*shape, prepared.collection->collection.name,
                catalog::qualityIn(prepared.collection->signatures, hit.id), out->mutable_shape());
        out->set_score(hit.score);
        if (prepared.explain) RETURN_IF_ERROR(explainHit(services, prepared, *scorer, hit, out));
        const std::size_t bytes = out->ByteSizeLong();
        if (bytes > room) {
            return fail(ErrorCode::kInvalidArgument,
                        "the answer would exceed " + std::to_string(catalog::kMaxAnswerBytes) +
                            " bytes; ask for a smaller k or fewer queries, or set no_explanation");
        }
        room -= bytes;
    }
    return {};
}

Result<void> search(const Services& services, const Call& call, const Prepared& prepared,
                    const Signature& query, std::size_t& room, pb::SearchResponse* response) {
    const auto found =
        services.searches.run(query, prepared.collection->signatures, prepared.options, call.run());
    RETURN_IF_ERROR(found);
    return answer(services, prepared, query, *found, room, response);
}

/// A stored shape as a query.
struct StoredQuery {
    Signature signature;
    std::int64_t id = 0;
};

Result<StoredQuery> storedQuery(const Services& services, const Prepared& prepared, const std::string& key) {
    const auto found = services.catalog.findShape(prepared.collection, key);
    RETURN_IF_ERROR(found);
    auto signature = services.catalog.signature(*found);
    RETURN_IF_ERROR(signature);
    return StoredQuery{std::move(*signature), found->shape.id};
}

Result<BatchQuery> batchQuery(const Services& services, const Prepared& prepared,
                              const v1::SearchBatchRequest::Query& query) {
    switch (query.by_case()) {
        case v1::SearchBatchRequest::Query::kKey: {
            auto stored = storedQuery(services, prepared, query.key());
            RETURN_IF_ERROR(stored);
            return BatchQuery{std::move(stored->signature), stored->id};
        }
        case v1::SearchBatchRequest::Query::kSignature: {
            auto signature = decodeSignature(query.signature());
            RETURN_IF_ERROR(signature);
            return BatchQuery{std::move(*signature), std::nullopt};
        }
        case v1::SearchBatchRequest::Query::BY_NOT_SET: break;
    }
    return fail(ErrorCode::kInvalidArgument, "neither key nor signature is set");
}

Result<void> ofQuery(int i, const Error& error) {
    return fail(error.code, "query " + std::to_string(i) + ": " + error.message);
}

/// Reads all queries first and searches them together.
Result<void> searchBatch(const Services& services, const Call& call, const Prepared& prepared,
                         const v1::SearchBatchRequest& request, v1::SearchBatchResponse* response) {
    std::vector<BatchQuery> queries;
    for (int i = 0; i < request.queries_size(); ++i) {
        auto query = batchQuery(services, prepared, request.queries(i));
        if (!query) return ofQuery(i, query.error());
        queries.push_back(std::move(*query));
    }
    const auto found =
        services.searches.runBatch(queries, prepared.collection->signatures, prepared.options, call.run());
    RETURN_IF_ERROR(found);
    std::size_t room = catalog::kMaxAnswerBytes;
    for (int i = 0; i < request.queries_size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        const auto done =
            answer(services, prepared, queries[at].signature, (*found)[at], room, response->add_responses());
        if (!done) return ofQuery(i, done.error());
    }
    return {};
}

}  // namespace

grpc::Status SearchServiceHandler::SearchByKey(grpc::ServerContext* context,
                                               const v1::SearchByKeyRequest* request,
                                               v1::SearchResponse* response) {
    return handle(services_, context, "SearchByKey", [&](Call& call) -> Result<void> {
        call.noteKey(request->key());
        auto prepared = prepare(services_, call, request->options());
        RETURN_IF_ERROR(prepared);
        const auto stored = storedQuery(services_, *prepared, request->key());
        RETURN_IF_ERROR(stored);
        if (!request->include_self()) prepared->options.excludeId = stored->id;
        std::size_t room = catalog::kMaxAnswerBytes;
        return search(services_, call, *prepared, stored->signature, room, response);
    });
}

grpc::Status SearchServiceHandler::SearchByScan(grpc::ServerContext* context,
                                                grpc::ServerReader<v1::SearchByScanRequest>* reader,
                                                v1::SearchResponse* response) {
    return handle(services_, context, "SearchByScan", [&](Call& call) -> Result<void> {
        Prepared prepared;
        catalog::ScanUpload upload(services_.config.limits.maxPoints, services_.admission.uploads);
        const auto checkSearchHeader = [&](const v1::SearchByScanHeader& header) -> Result<void> {
            auto checked = prepare(services_, call, header.options());
            RETURN_IF_ERROR(checked);
            prepared = std::move(*checked);
            return {};
        };
        const auto scan = receiveScan<v1::SearchByScanRequest>(*reader, upload, call, checkSearchHeader);
        RETURN_IF_ERROR(scan);

        Result<Description> description = fail(ErrorCode::kInternal, "not segmented");
        {
            catalog::SegmentationSlots::Slot slot(services_.catalog.segmentationSlots());
            description =
                services_.catalog.describe(slot, scan->points(), prepared.collection->parameters, call.run());
        }
        RETURN_IF_ERROR(description);
        toProto(description->segmentation, response->mutable_report());
        response->set_seconds_segment(description->segmentation.totalSeconds);
        std::size_t room = catalog::kMaxAnswerBytes;
        return search(services_, call, prepared, description->signature, room, response);
    });
}

grpc::Status SearchServiceHandler::SearchBySignature(grpc::ServerContext* context,
                                                     const v1::SearchBySignatureRequest* request,
                                                     v1::SearchResponse* response) {
    return handle(services_, context, "SearchBySignature", [&](Call& call) -> Result<void> {
        const auto prepared = prepare(services_, call, request->options());
        RETURN_IF_ERROR(prepared);
        const auto signature = decodeSignature(request->signature());
        RETURN_IF_ERROR(signature);
        std::size_t room = catalog::kMaxAnswerBytes;
        return search(services_, call, *prepared, *signature, room, response);
    });
}

grpc::Status SearchServiceHandler::SearchBatch(grpc::ServerContext* context,
                                               const v1::SearchBatchRequest* request,
                                               v1::SearchBatchResponse* response) {
    return handle(services_, context, "SearchBatch", [&](Call& call) -> Result<void> {
        const int count = request->queries_size();
        call.note({"queries", std::int64_t{count}});
        RETURN_IF_ERROR(
            catalog::checkBatchSize(static_cast<std::uint64_t>(count), services_.config.limits.maxBatch));
        const auto prepared = prepare(services_, call, request->options());
        RETURN_IF_ERROR(prepared);
        return searchBatch(services_, call, *prepared, *request, response);
    });
}

grpc::Status SearchServiceHandler::Compare(grpc::ServerContext* context, const v1::CompareRequest* request,
                                           v1::CompareResponse* response) {
    return handle(services_, context, "Compare", [&](Call& call) -> Result<void> {
        Signature signatures[2];
        const pb::ShapeRef* refs[2] = {&request->query(), &request->other()};
        for (int i = 0; i < 2; ++i) {
            const auto found = call.shape(*refs[i]);
            auto signature =
                found ? services_.catalog.signature(*found) : Result<Signature>(fail(found.error()));
            if (!signature) {
                return fail(signature.error().code,
                            (i == 0 ? "query: " : "other: ") + signature.error().message);
            }
            signatures[i] = std::move(*signature);
        }
        ScoreOptions options;
        options.reflection = !request->forbid_reflection();
        options.keepScale = request->keep_scale();
        options.partial = request->partial();
        const Explanation explanation = explain(signatures[0], signatures[1], options);
        response->set_score(explanation.score);
        toProto(explanation, response->mutable_explanation());
        toProto(signatures[0], response->mutable_query());
        toProto(signatures[1], response->mutable_other());
        return {};
    });
}

}  // namespace shapedb::rpc
