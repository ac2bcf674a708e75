// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/search_service.h"

#include <utility>

#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/request_checks.h"
#include "server/catalog/scan_upload.h"
#include "server/catalog/searches.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/message_bytes.h"
#include "server/rpc/receive_scan.h"

namespace shapedb::rpc {
namespace {

/// Of a search that rebuilds overtake.
constexpr int kMostTries = 5;

template <typename Message>
ScoreOptions scoreOptionsFrom(const Message& message) {
    ScoreOptions options;
    options.reflection = !message.forbid_reflection();
    options.keepScale = message.keep_scale();
    options.partial = message.partial();
    return options;
}

Result<catalog::PreparedSearch> prepare(const Services& services, Call& call,
                                        const pb::SearchOptions& options) {
    call.note({"k", std::uint64_t{options.k()}});
    const auto collection = call.collection(options.collection());
    RETURN_IF_ERROR(collection);
    catalog::SearchRequest request;
    request.k = options.k();
    request.threshold = options.threshold();
    request.filter = options.filter();
    request.score = scoreOptionsFrom(options);
    request.freeScale = options.free_scale();
    request.explain = !options.no_explanation();
    if (options.has_verify()) request.verify = options.verify();
    request.verifyOptions.mostCandidates = options.verify_candidates();
    if (options.has_one_sided()) request.verifyOptions.oneSided = options.one_sided();
    request.groupBy = options.group_by();
    request.perGroup = options.per_group();
    if (options.has_viewpoint()) request.verifyOptions.viewpoint = fromProto(options.viewpoint());
    request.atLeast = options.at_least();
    request.allowPartial = options.allow_partial();
    return services.searches.prepare(*collection, request);
}

/// Prepares a search and calls `body(prepared)`; once more, with the collection as it is then, if a rebuild
/// was put in place meanwhile.
template <typename Body>
Result<void> searchPrepared(const Services& services, Call& call, const pb::SearchOptions& options,
                            const Body& body) {
    for (int tries = 1;; ++tries) {
        auto prepared = prepare(services, call, options);
        RETURN_IF_ERROR(prepared);
        const Result<void> done = body(*prepared);
        if (done || tries == kMostTries || !prepared->superseded->load()) return done;
    }
}

/// Counts a hit to the group before it, or begins the next.
void noteGroup(const std::optional<std::string>& value, pb::SearchResponse* response) {
    const auto isOf = [&](const pb::HitGroup& group) {
        return group.has_value() == value.has_value() && (!value || group.value() == *value);
    };
    if (response->groups().empty() || !isOf(*response->groups().rbegin())) {
        pb::HitGroup* group = response->add_groups();
        if (value) group->set_value(*value);
    }
    pb::HitGroup& last = *response->mutable_groups()->rbegin();
    last.set_hits(last.hits() + 1);
}

Result<void> answer(const Services& services, const catalog::PreparedSearch& prepared, const Signature& query,
                    const VerifiedResult& found, catalog::AnswerRoom& room, pb::SearchResponse* response) {
    response->set_candidates(found.counts.candidates);
    response->set_filtered(found.counts.filtered);
    response->set_scored(found.counts.scored);
    response->set_seconds_search(found.seconds);
    response->set_candidates_verified(found.verified);
    response->set_not_exact(!found.exact);
    response->set_pending(prepared.pending);
    response->set_covered(found.covered);
    response->set_unit(wire::toProto(prepared.collection->parameters.unit));
    response->set_left_right_untold(leftRightUntold(query, prepared.options.score, found.verified > 0));
    toProto(query, response->mutable_query());
    if (response->query().has_attributes()) {
        response->mutable_query()->mutable_attributes()->clear_statistics();
    }
    return services.searches.visitHits(prepared, query, found, [&](const catalog::FoundHit& hit) {
        pb::Hit* out = response->add_hits();
        toProto(hit.shape, prepared.collection->collection.name, hit.quality, out->mutable_shape());
        out->set_score(hit.score);
        out->set_signature_score(hit.signatureScore);
        if (hit.fit) toProto(*hit.fit, out->mutable_fit());
        out->set_verdict(wire::toProto(hit.verdict));
        out->set_verdict_reliability(reliabilityOf(hit.verdict));
        if (hit.explanation) toProto(*hit.explanation, out->mutable_explanation());
        if (prepared.options.grouping) noteGroup(hit.group, response);
        return room.take(out->ByteSizeLong());
    });
}

Result<void> search(const Services& services, const Call& call, const catalog::PreparedSearch& prepared,
                    const VerifiableQuery& query, catalog::AnswerRoom& room, pb::SearchResponse* response) {
    const auto found = services.searches.run(prepared, query, call.run());
    RETURN_IF_ERROR(found);
    return answer(services, prepared, query.signature, *found, room, response);
}

catalog::QuerySource sourceFrom(const v1::SearchBatchRequest::Query& query) {
    catalog::QuerySource source;
    if (query.has_key()) source.key = &query.key();
    if (query.has_signature()) source.signature = &query.signature();
    return source;
}

Result<void> searchBatch(const Services& services, const Call& call, catalog::PreparedSearch& prepared,
                         const v1::SearchBatchRequest& request, catalog::AnswerRoom& room,
                         BatchAnswer& batch) {
    std::vector<catalog::QuerySource> sources;
    for (const auto& query : request.queries()) sources.push_back(sourceFrom(query));
    return services.searches.runBatch(
        prepared, sources, call.run(),
        [&](std::size_t i, const Signature& query, const VerifiedResult& found) -> Result<void> {
            v1::SearchResponse response;
            RETURN_IF_ERROR(answer(services, prepared, query, found, room, &response));
            batch.set(i, response);
            return {};
        });
}

}  // namespace

SearchServiceHandler::SearchServiceHandler(const Services& services) : services_(services) {
    serve("SearchByScan", this, &SearchServiceHandler::searchByScan);
    serve("SearchByScanInStages", this, &SearchServiceHandler::searchByScanInStages);
    serve("SearchByKey", this, &SearchServiceHandler::searchByKey);
    serve("SearchBySignature", this, &SearchServiceHandler::searchBySignature);
    serve("SearchBatch", this, &SearchServiceHandler::searchBatch);
    serve("Compare", this, &SearchServiceHandler::compare);
}

grpc::Status SearchServiceHandler::searchByKey(grpc::ServerContext* context,
                                               Request<v1::SearchByKeyRequest>& request,
                                               v1::SearchResponse* response) {
    return handle(services_, context, operations::kSearchByKey, request, [&](Call& call) -> Result<void> {
        call.noteKey(request->key());
        const auto run = [&](catalog::PreparedSearch& prepared) -> Result<void> {
            const auto query =
                services_.searches.storedQuery(prepared, request->key(), request->include_self());
            RETURN_IF_ERROR(query);
            return search(services_, call, prepared, *query, request.answerRoom(services_.admission.answers),
                          response);
        };
        return searchPrepared(services_, call, request->options(), run);
    });
}

grpc::Status SearchServiceHandler::searchByScan(grpc::ServerContext* context,
                                                Upload<v1::SearchByScanRequest>& messages,
                                                v1::SearchResponse* response) {
    return handle(services_, context, operations::kSearchByScan, messages,
                  [&](Call& call) { return receiveAndSearch(call, messages, call.run(), *response); });
}

grpc::Status SearchServiceHandler::searchByScanInStages(grpc::ServerContext* context,
                                                        Upload<v1::SearchByScanRequest>& messages,
                                                        UploadReplies<v1::SearchByScanEvent>* writer) {
    return handle(
        services_, context, operations::kSearchByScanInStages, messages, [&](Call& call) -> Result<void> {
            v1::SearchByScanEvent last;
            RETURN_IF_ERROR(receiveAndSearch(call, messages,
                                             tellingStages<v1::SearchByScanEvent>(call, *writer, true),
                                             *last.mutable_response()));
            return call.write(*writer, last);
        });
}

Result<void> SearchServiceHandler::receiveAndSearch(Call& call, Upload<v1::SearchByScanRequest>& messages,
                                                    const RunContext& running, v1::SearchResponse& response) {
    pb::SearchOptions options;
    catalog::ScanUpload upload(services_.config.limits.maxPoints, services_.admission.uploads);
    const auto checkSearchHeader = [&](const v1::SearchByScanHeader& header) -> Result<void> {
        options = header.options();
        const auto checked = prepare(services_, call, options);
        RETURN_IF_ERROR(checked);
        return {};
    };
    const auto scan = receiveScan(services_, messages, upload, call, checkSearchHeader);
    RETURN_IF_ERROR(scan);

    const auto run = [&](const catalog::PreparedSearch& prepared) -> Result<void> {
        const auto searched = services_.searches.byScan(prepared, *scan, running);
        RETURN_IF_ERROR(searched);
        const Description& description = searched->description;
        toProto(description.segmentation, response.mutable_report());
        response.set_seconds_segment(description.segmentation.totalSeconds);
        return answer(services_, prepared, description.signature, searched->found,
                      messages.answerRoom(services_.admission.answers), &response);
    };
    return searchPrepared(services_, call, options, run);
}

grpc::Status SearchServiceHandler::searchBySignature(grpc::ServerContext* context,
                                                     Request<v1::SearchBySignatureRequest>& request,
                                                     v1::SearchResponse* response) {
    return handle(
        services_, context, operations::kSearchBySignature, request, [&](Call& call) -> Result<void> {
            const auto run = [&](const catalog::PreparedSearch& prepared) -> Result<void> {
                auto signature = decodeSignature(request->signature());
                RETURN_IF_ERROR(signature);
                return search(services_, call, prepared, {{std::move(*signature), std::nullopt}, nullptr},
                              request.answerRoom(services_.admission.answers), response);
            };
            return searchPrepared(services_, call, request->options(), run);
        });
}

grpc::Status SearchServiceHandler::searchBatch(grpc::ServerContext* context,
                                               Request<v1::SearchBatchRequest>& request,
                                               grpc::ByteBuffer* response) {
    return handle(services_, context, operations::kSearchBatch, request, [&](Call& call) -> Result<void> {
        const int count = request->queries_size();
        call.note({"queries", std::int64_t{count}});
        RETURN_IF_ERROR(call.useCollection(request->options().collection()));
        RETURN_IF_ERROR(
            catalog::checkBatchSize(static_cast<std::uint64_t>(count), services_.config.limits.maxBatch));
        const auto run = [&](catalog::PreparedSearch& prepared) -> Result<void> {
            BatchAnswer batch(static_cast<std::size_t>(count));
            RETURN_IF_ERROR(rpc::searchBatch(services_, call, prepared, *request,
                                             request.answerRoom(services_.admission.answers), batch));
            *response = batch.message();
            return {};
        };
        return searchPrepared(services_, call, request->options(), run);
    });
}

grpc::Status SearchServiceHandler::compare(grpc::ServerContext* context, Request<v1::CompareRequest>& request,
                                           v1::CompareResponse* response) {
    return handle(services_, context, operations::kCompare, request, [&](Call& call) -> Result<void> {
        std::vector<catalog::ShapeName> names;
        for (const pb::ShapeRef* ref : {&request->query(), &request->other()}) {
            call.noteKey(ref->key());
            const auto collection = call.useCollection(ref->collection());
            RETURN_IF_ERROR(collection);
            names.push_back({*collection, ref->key()});
        }
        const auto compared = services_.searches.compare(names[0], names[1], scoreOptionsFrom(*request),
                                                         request->free_scale(), call.run());
        RETURN_IF_ERROR(compared);
        const VerifiedExplanation& verified = compared->verified;
        response->set_score(verified.score);
        response->set_signature_score(verified.signatureScore);
        toProto(verified.explanation, response->mutable_explanation());
        if (verified.fit) toProto(*verified.fit, response->mutable_fit());
        response->set_verdict(wire::toProto(verified.verdict));
        response->set_verdict_reliability(reliabilityOf(verified.verdict));
        toProto(compared->query, response->mutable_query());
        toProto(compared->other, response->mutable_other());
        response->set_unit(wire::toProto(compared->unit));
        response->set_left_right_untold(
            leftRightUntold(compared->query, scoreOptionsFrom(*request), verified.fit.has_value()));
        return {};
    });
}

}  // namespace shapedb::rpc
