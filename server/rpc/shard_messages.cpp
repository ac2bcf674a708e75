// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/shard_messages.h"

#include <algorithm>
#include <utility>

#include "common/wire.h"
#include "core/base/return_if_error.h"
#include "server/rpc/status.h"

namespace shapedb::rpc {

namespace {

Error notOurs(const char* what) {
    return {ErrorCode::kInvalidArgument, std::string("a message between servers is not as expected: ") +
                                             what + "; do all servers of the cluster have the same version?"};
}

// Queries and asks ---------------------------------------------------------------------------

void queryToProto(const cluster::ShardQuery& query, shards::Query* out) {
    out->set_collection_id(query.collectionId);
    out->set_signature(query.signature);
    out->set_surface(query.surface);
    out->set_reflection(query.score.reflection);
    out->set_keep_scale(query.score.keepScale);
    out->set_partial(query.score.partial);
    out->set_kernel_width(query.score.kernelWidth);
    out->set_background(query.background);
}

std::shared_ptr<const cluster::ShardQuery> queryFrom(const shards::Query& query) {
    auto out = std::make_shared<cluster::ShardQuery>();
    out->collectionId = query.collection_id();
    out->signature = query.signature();
    out->surface = query.surface();
    out->score = {query.reflection(), query.keep_scale(), query.partial(), query.kernel_width()};
    out->background = query.background();
    return out;
}

using ShardEpochs = std::vector<std::pair<int, std::int64_t>>;

void askToProto(const ShardEpochs& epochs, std::int64_t number, std::int64_t generation, shards::Ask* out) {
    for (const auto& [shard, epoch] : epochs) {
        out->add_shards(static_cast<std::uint32_t>(shard));
        out->add_epochs(epoch);
    }
    out->set_at_least(number);
    out->set_least_generation(generation);
}

Result<ShardEpochs> shardsFrom(const shards::Ask& ask) {
    if (ask.shards_size() != ask.epochs_size()) return fail(notOurs("shards without epochs"));
    ShardEpochs epochs;
    for (int i = 0; i < ask.shards_size(); ++i) {
        const auto shard = static_cast<int>(ask.shards(i));
        const bool rises = epochs.empty() || epochs.back().first < shard;
        if (shard < 0 || shard >= cluster::kShards || !rises) return fail(notOurs("its shards"));
        epochs.emplace_back(shard, ask.epochs(i));
    }
    return epochs;
}

// Candidates ---------------------------------------------------------------------------------

void candidateToProto(const Candidate& candidate, shards::Candidate* out) {
    out->set_id(candidate.id);
    out->set_score(candidate.score);
    if (candidate.group) out->set_group(*candidate.group);
    if (candidate.quality) out->set_quality(*candidate.quality);
}

Candidate candidateFrom(const shards::Candidate& candidate) {
    Candidate out;
    out.id = candidate.id();
    out.score = candidate.score();
    if (candidate.has_group()) out.group = std::make_shared<const std::string>(candidate.group());
    if (candidate.has_quality()) out.quality = candidate.quality();
    return out;
}

void viewToProto(const ViewSearch& search, shards::View* out) {
    const auto& levels = search.view.levels;
    out->set_levels(std::string(levels.begin(), levels.end()));
    out->set_size(search.view.size);
    out->set_reflection(search.options.reflection);
    out->set_keep_scale(search.options.keepScale);
    out->set_side_known(search.options.sideKnown);
    out->set_count(search.count);
}

Result<ViewSearch> viewFrom(const shards::View& view) {
    ViewSearch search;
    if (view.levels().size() != search.view.levels.size()) return fail(notOurs("the length of a view"));
    std::transform(view.levels().begin(), view.levels().end(), search.view.levels.begin(),
                   [](char level) { return static_cast<std::uint8_t>(level); });
    search.view.size = view.size();
    search.options = {view.reflection(), view.keep_scale(), view.side_known()};
    search.count = view.count();
    return search;
}

// Fits ---------------------------------------------------------------------------------------

Point3 pointFrom(const v1::Vector3& vector) { return {vector.x(), vector.y(), vector.z()}; }

Result<FitPose> poseFrom(const v1::FitPose& pose) {
    FitPose out;
    const v1::Motion& motion = pose.motion();
    if (motion.rotation_size() != 9) return fail(notOurs("a rotation"));
    for (int i = 0; i < 9; ++i) {
        out.motion.rotation[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)] =
            motion.rotation(i);
    }
    out.motion.scale = motion.scale();
    out.motion.reflected = motion.reflected();
    out.motion.translation = pointFrom(motion.translation());
    out.score = pose.score();
    out.explainedQuery = pose.explained_query();
    out.explainedOther = pose.explained_other();
    out.residual = pose.residual();
    return out;
}

Result<std::shared_ptr<const FitResult>> fitFrom(const v1::Fit& fit) {
    auto out = std::make_shared<FitResult>();
    auto best = poseFrom(fit.best());
    RETURN_IF_ERROR(best);
    out->best = *best;
    switch (fit.kind()) {
        case v1::FIT_KIND_WHOLE: out->kind = FitKind::kWhole; break;
        case v1::FIT_KIND_ONE_SIDED: out->kind = FitKind::kOneSided; break;
        case v1::FIT_KIND_PIECE: out->kind = FitKind::kPiece; break;
        default: return fail(notOurs("the kind of a fit"));
    }
    out->misfit = fit.misfit();
    out->certainty = fit.certainty();
    out->handednessOpen = fit.left_right_open();
    for (const v1::FitPose& pose : fit.alternatives()) {
        auto alternative = poseFrom(pose);
        RETURN_IF_ERROR(alternative);
        out->alternatives.push_back(*alternative);
    }
    for (const v1::FreeAxis& axis : fit.axes()) {
        out->axes.push_back({pointFrom(axis.point()), pointFrom(axis.direction())});
    }
    return std::shared_ptr<const FitResult>(std::move(out));
}

}  // namespace

void toProto(const cluster::FindRequest& request, shards::FindRequest* out) {
    const SearchOptions& options = request.search.options;
    askToProto(request.ask.shards, request.ask.atLeast, request.ask.leastGeneration, out->mutable_ask());
    queryToProto(*request.query, out->mutable_query());
    out->set_k(options.k);
    out->set_threshold(options.threshold);
    out->set_filter(options.filter.text());
    if (options.excludeId) out->set_exclude_id(*options.excludeId);
    if (options.grouping) {
        out->set_group_by(options.grouping->key);
        out->set_per_group(options.grouping->perGroup);
    }
    out->set_best(request.search.best);
    out->set_groups(request.search.groups);
    if (request.search.views) viewToProto(*request.search.views, out->mutable_view());
    if (!request.among) return;
    shards::GroupList* among = out->mutable_among();
    for (const OwnGroup& group : *request.among) {
        shards::Group* one = among->add_groups();
        if (group) one->set_value(*group);
    }
}

Result<cluster::FindRequest> fromProto(const shards::FindRequest& request) {
    cluster::FindRequest out;
    auto epochs = shardsFrom(request.ask());
    RETURN_IF_ERROR(epochs);
    out.ask.shards = std::move(*epochs);
    out.ask.atLeast = request.ask().at_least();
    out.ask.leastGeneration = request.ask().least_generation();
    out.query = queryFrom(request.query());
    SearchOptions& options = out.search.options;
    options.k = request.k();
    options.threshold = request.threshold();
    auto filter = Filter::parse(request.filter());
    RETURN_IF_ERROR(filter);
    options.filter = std::move(*filter);
    options.score = out.query->score;
    if (request.has_exclude_id()) options.excludeId = request.exclude_id();
    if (request.has_group_by()) options.grouping = Grouping{request.group_by(), request.per_group()};
    out.search.best = request.best();
    out.search.groups = request.groups();
    if ((request.groups() || request.has_among()) && !options.grouping) return fail(notOurs("its groups"));
    if (request.has_view()) {
        auto views = viewFrom(request.view());
        RETURN_IF_ERROR(views);
        out.search.views = *views;
    }
    if (request.has_among()) {
        out.among.emplace();
        for (const shards::Group& group : request.among().groups()) {
            out.among->push_back(group.has_value() ? std::make_shared<const std::string>(group.value())
                                                   : nullptr);
        }
    }
    return out;
}

void toProto(const cluster::FindAnswer& answer, shards::FindResponse* out) {
    const cluster::Coverage& coverage = answer.coverage;
    askToProto(coverage.shards, coverage.number, coverage.generation, out->mutable_covered());
    for (const Candidate& one : answer.found.best) candidateToProto(one, out->add_best());
    for (const Candidate& one : answer.found.ofGroups) candidateToProto(one, out->add_of_groups());
    for (const ViewCandidate& one : answer.found.byViews) {
        shards::ViewCandidate* near = out->add_by_views();
        candidateToProto(one.shape, near->mutable_shape());
        near->set_distance(one.distance);
        near->set_comparable(one.comparable);
    }
    out->set_candidates(answer.found.counts.candidates);
    out->set_filtered(answer.found.counts.filtered);
    for (const std::uint64_t left : answer.found.counts.scans.left) out->add_scans(left);
    out->set_scored(answer.found.counts.scored);
}

Result<cluster::FindAnswer> fromProto(const shards::FindResponse& answer) {
    cluster::FindAnswer out;
    auto epochs = shardsFrom(answer.covered());
    RETURN_IF_ERROR(epochs);
    out.coverage = {std::move(*epochs), answer.covered().at_least(), answer.covered().least_generation()};
    for (const auto& one : answer.best()) out.found.best.push_back(candidateFrom(one));
    for (const auto& one : answer.of_groups()) out.found.ofGroups.push_back(candidateFrom(one));
    for (const auto& one : answer.by_views()) {
        out.found.byViews.push_back({candidateFrom(one.shape()), one.distance(), one.comparable()});
    }
    out.found.counts.candidates = answer.candidates();
    out.found.counts.filtered = answer.filtered();
    auto& left = out.found.counts.scans.left;
    if (answer.scans_size() != static_cast<int>(left.size())) return fail(notOurs("its counts"));
    std::copy(answer.scans().begin(), answer.scans().end(), left.begin());
    out.found.counts.scored = answer.scored();
    return out;
}

void toProto(const cluster::FitRequest& request, shards::FitRequest* out) {
    queryToProto(*request.query, out->mutable_query());
    for (const FittedShape& shape : request.shapes) {
        out->add_ids(shape.id);
        if (request.preferUnmirrored) wire::toProto(*shape.fit, out->add_fits());
    }
    out->set_whole(request.options.kinds.whole);
    out->set_one_sided(request.options.kinds.oneSided);
    out->set_piece(request.options.kinds.piece);
}

Result<cluster::FitRequest> fromProto(const shards::FitRequest& request) {
    cluster::FitRequest out;
    out.query = queryFrom(request.query());
    out.preferUnmirrored = request.fits_size() > 0;
    if (out.preferUnmirrored && request.fits_size() != request.ids_size()) return fail(notOurs("its fits"));
    for (int i = 0; i < request.ids_size(); ++i) {
        FittedShape& shape = out.shapes.emplace_back();
        shape.id = request.ids(i);
        if (!out.preferUnmirrored) continue;
        auto fit = fitFrom(request.fits(i));
        RETURN_IF_ERROR(fit);
        shape.fit = std::move(*fit);
    }
    out.options.kinds = {request.whole(), request.one_sided(), request.piece()};
    out.options.keepScale = out.query->score.keepScale;
    out.options.reflection = out.query->score.reflection;
    return out;
}

void toProto(const cluster::FitAnswer& answer, shards::FitResponse* out) {
    for (const auto& fit : answer) {
        shards::FitResponse::One* one = out->add_fits();
        if (fit) wire::toProto(*fit, one->mutable_fit());
    }
}

Result<cluster::FitAnswer> fromProto(const shards::FitResponse& answer) {
    cluster::FitAnswer out;
    for (const auto& one : answer.fits()) {
        if (!one.has_fit()) {
            out.push_back(nullptr);
            continue;
        }
        auto fit = fitFrom(one.fit());
        RETURN_IF_ERROR(fit);
        out.push_back(std::move(*fit));
    }
    return out;
}

grpc::Status shardStatus(const Error& error) {
    return {statusCodeOf(error.code), error.message, errorCodeName(error.code)};
}

Error shardError(const grpc::Status& status) {
    for (const ErrorCode code :
         {ErrorCode::kInvalidArgument, ErrorCode::kMalformedFilter, ErrorCode::kMalformedSignature,
          ErrorCode::kNotReady, ErrorCode::kCancelled, ErrorCode::kDeadlineExceeded}) {
        if (status.error_details() == errorCodeName(code)) return {code, status.error_message()};
    }
    return {ErrorCode::kUnavailable, "another server did not answer: " + status.error_message()};
}

}  // namespace shapedb::rpc
