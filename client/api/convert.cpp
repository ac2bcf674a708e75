// SPDX-License-Identifier: Apache-2.0
#include "client/api/convert.h"

#include <algorithm>

namespace shapedb::client {

namespace {

ShapeState fromWire(v1::ShapeState from) {
    switch (from) {
        case v1::SHAPE_STATE_READY: return ShapeState::kReady;
        case v1::SHAPE_STATE_FAILED: return ShapeState::kFailed;
        default: return ShapeState::kPending;
    }
}

Motion fromWire(const v1::Motion& from) {
    Motion motion;
    motion.scale = from.scale();
    motion.reflected = from.reflected();
    motion.translation = wire::fromProto(from.translation());
    if (from.rotation_size() == 9) {
        for (int i = 0; i < 9; ++i) {
            motion.rotation[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)] =
                from.rotation(i);
        }
    }
    return motion;
}

}  // namespace

Error fromWire(const v1::Failure& from) { return {errorCodeFromName(from.error()), from.message()}; }

Timestamp fromWire(const google::protobuf::Timestamp& from) {
    // Whatever a server sends: seconds reach further than microseconds.
    using std::chrono::seconds;
    constexpr auto kLast = std::chrono::duration_cast<seconds>(Timestamp::duration::max()) - seconds(1);
    const seconds whole = std::clamp(seconds(from.seconds()), -kLast, kLast);
    return Timestamp(whole +
                     std::chrono::duration_cast<Timestamp::duration>(std::chrono::nanoseconds(from.nanos())));
}

google::protobuf::Timestamp toWire(Timestamp from) {
    const auto since = from.time_since_epoch();
    const auto seconds = std::chrono::floor<std::chrono::seconds>(since);
    google::protobuf::Timestamp to;
    to.set_seconds(seconds.count());
    to.set_nanos(static_cast<std::int32_t>(std::chrono::nanoseconds(since - seconds).count()));
    return to;
}

const char* stateName(ShapeState state) noexcept {
    switch (state) {
        case ShapeState::kPending: return "pending";
        case ShapeState::kReady: return "ready";
        case ShapeState::kFailed: return "failed";
    }
    return "pending";
}

const char* outcomeName(AddOutcome outcome) noexcept {
    switch (outcome) {
        case AddOutcome::kCreated: return "created";
        case AddOutcome::kReplaced: return "replaced";
        case AddOutcome::kMetadataChanged: return "metadata changed";
        case AddOutcome::kUnchanged: return "unchanged";
        case AddOutcome::kRetried: return "retried";
    }
    return "created";
}

void fill(const ShapeRef& from, v1::ShapeRef* to) {
    to->set_collection(from.collection);
    to->set_key(from.key);
}

void fill(const SearchOptions& from, v1::SearchOptions* to) {
    to->set_collection(from.collection);
    to->set_k(from.k);
    to->set_threshold(from.threshold);
    to->set_filter(from.filter);
    to->set_forbid_reflection(!from.reflection);
    to->set_keep_scale(from.keepScale);
    to->set_free_scale(from.freeScale);
    to->set_partial(from.partial);
    to->set_no_explanation(!from.explanation);
    if (from.verify) to->set_verify(*from.verify);
    to->set_verify_candidates(from.verifyCandidates);
    if (from.oneSided) to->set_one_sided(*from.oneSided);
    if (from.viewpoint) wire::toProto(*from.viewpoint, to->mutable_viewpoint());
    to->set_group_by(from.groupBy);
    to->set_per_group(from.perGroup);
    to->set_at_least(from.atLeast);
    to->set_allow_partial(from.allowPartial);
}

void fill(const MetadataChange& from, v1::MetadataChange* to) {
    to->mutable_set()->insert(from.set.begin(), from.set.end());
    to->mutable_remove()->Add(from.remove.begin(), from.remove.end());
    to->set_replace_all(from.replaceAll);
}

void fill(const ShapeSelection& from, v1::ShapeSelection* to) {
    if (from.filter) {
        to->set_filter(*from.filter);
    } else {
        to->mutable_keys()->mutable_keys()->Add(from.keys.begin(), from.keys.end());
    }
}

v1::ShapeOrder toWire(ShapeOrder order) {
    switch (order) {
        case ShapeOrder::kId: return v1::SHAPE_ORDER_ID;
        case ShapeOrder::kKey: return v1::SHAPE_ORDER_KEY;
        case ShapeOrder::kUpdated: return v1::SHAPE_ORDER_UPDATED;
    }
    return v1::SHAPE_ORDER_ID;
}

v1::AddMode toWire(AddMode mode) {
    switch (mode) {
        case AddMode::kUpsert: return v1::ADD_MODE_UPSERT;
        case AddMode::kInsertOnly: return v1::ADD_MODE_INSERT_ONLY;
        case AddMode::kUpdateOnly: return v1::ADD_MODE_UPDATE_ONLY;
        case AddMode::kSamePoints: return v1::ADD_MODE_SAME_POINTS;
    }
    return v1::ADD_MODE_UPSERT;
}

v1::ShapeState toWire(const std::optional<ShapeState>& state) {
    if (!state) return v1::SHAPE_STATE_UNSPECIFIED;
    switch (*state) {
        case ShapeState::kPending: return v1::SHAPE_STATE_PENDING;
        case ShapeState::kReady: return v1::SHAPE_STATE_READY;
        case ShapeState::kFailed: return v1::SHAPE_STATE_FAILED;
    }
    return v1::SHAPE_STATE_UNSPECIFIED;
}

Shape fromWire(const v1::Shape& from) {
    Shape to;
    to.collection = from.collection();
    to.key = from.key();
    to.id = from.id();
    to.version = from.version();
    to.state = fromWire(from.state());
    to.pointCount = from.point_count();
    to.sha256 = from.sha256();
    to.metadata.insert(from.metadata().begin(), from.metadata().end());
    to.created = fromWire(from.created());
    to.updated = fromWire(from.updated());
    if (from.has_failure()) to.failure = fromWire(from.failure());
    if (from.has_quality()) to.quality = from.quality();
    to.origin = wire::fromProto(from.origin());
    return to;
}

AddOutcome fromWire(v1::AddShapeResponse::Outcome from) {
    switch (from) {
        case v1::AddShapeResponse::OUTCOME_REPLACED: return AddOutcome::kReplaced;
        case v1::AddShapeResponse::OUTCOME_METADATA_CHANGED: return AddOutcome::kMetadataChanged;
        case v1::AddShapeResponse::OUTCOME_UNCHANGED: return AddOutcome::kUnchanged;
        case v1::AddShapeResponse::OUTCOME_RETRIED: return AddOutcome::kRetried;
        default: return AddOutcome::kCreated;
    }
}

IngestEvent fromWire(const v1::IngestEvent& from) {
    IngestEvent to;
    to.state = fromWire(from.state());
    to.stage = from.stage();
    to.done = from.done();
    to.total = from.total();
    if (from.has_failure()) to.failure = fromWire(from.failure());
    if (from.has_quality()) to.quality = from.quality();
    return to;
}

Signature fromWire(const v1::Signature& from) {
    Signature to;
    to.scale = from.scale();
    to.volume = from.volume();
    to.encoded = from.encoded();
    for (const v1::WeightedPoint& point : from.points()) {
        WeightedPoint out;
        out.position = wire::fromProto(point.position());
        out.weight = point.weight();
        out.volumeShare = point.volume_share();
        out.maximumRadius = point.peak_radius();
        const auto count = std::min(static_cast<std::size_t>(point.extents_size()), out.extents.size());
        std::copy_n(point.extents().begin(), count, out.extents.begin());
        to.points.push_back(out);
    }
    if (from.has_attributes()) {
        to.attributes.emplace();
        to.attributes->quality = from.attributes().quality();
        for (const v1::ShapeStatistic& statistic : from.attributes().statistics()) {
            to.attributes->statistics.push_back({statistic.name(),
                                                 {statistic.shares().begin(), statistic.shares().end()},
                                                 statistic.of_interior()});
        }
    }
    return to;
}

SegmentationReport fromWire(const v1::SegmentationReport& from) {
    SegmentationReport to;
    to.points = from.points();
    to.pointsUsed = from.points_used();
    to.duplicates = from.duplicates();
    to.outliers = from.outliers();
    to.outlierClusters = from.outlier_clusters();
    if (from.has_quality()) to.quality = from.quality();
    to.doubt = wire::fromProto(from.doubt());
    to.interiorSource = wire::fromProto(from.interior_source()).value_or(InteriorSource::kWalk);
    to.angleDegrees = from.angle_degrees();
    to.noise = from.noise();
    to.tetrahedra = from.tetrahedra();
    to.interiorTetrahedra = from.interior_tetrahedra();
    to.maxima = from.maxima();
    to.segments = from.segments();
    to.volume = from.volume();
    to.delaunaySeconds = from.delaunay_seconds();
    to.totalSeconds = from.total_seconds();
    for (const v1::StageTime& stage : from.stages()) to.stages.push_back({stage.stage(), stage.seconds()});
    return to;
}

Explanation fromWire(const v1::Explanation& from) {
    Explanation to;
    to.similarity = from.similarity();
    to.dissimilarity = from.dissimilarity();
    to.motion = fromWire(from.motion());
    for (const v1::SegmentMatch& match : from.matches()) {
        to.matches.push_back({match.query_segment(), match.hit_segment(), match.share(), match.distance()});
    }
    to.unmatchedQuery.assign(from.unmatched_query().begin(), from.unmatched_query().end());
    to.unmatchedHit.assign(from.unmatched_hit().begin(), from.unmatched_hit().end());
    to.degenerate = from.degenerate();
    for (const v1::ScoreTerm& term : from.terms()) {
        to.terms.push_back({term.name(), term.distance(), term.weight()});
    }
    return to;
}

namespace {

FitPose fromWire(const v1::FitPose& from) {
    return {fromWire(from.motion()), from.score(), from.explained_query(), from.explained_other(),
            from.residual()};
}

FitKind fromWire(v1::FitKind from) {
    switch (from) {
        case v1::FIT_KIND_ONE_SIDED: return FitKind::kOneSided;
        case v1::FIT_KIND_PIECE: return FitKind::kPiece;
        default: return FitKind::kWhole;
    }
}

}  // namespace

Fit fromWire(const v1::Fit& from) {
    Fit to;
    to.best = fromWire(from.best());
    to.kind = fromWire(from.kind());
    to.misfit = from.misfit();
    to.certainty = from.certainty();
    to.handednessOpen = from.left_right_open();
    for (const v1::FitPose& pose : from.alternatives()) to.alternatives.push_back(fromWire(pose));
    for (const v1::FreeAxis& axis : from.axes()) {
        to.axes.push_back({wire::fromProto(axis.point()), wire::fromProto(axis.direction())});
    }
    return to;
}

Comparison fromWire(const v1::CompareResponse& from) {
    Comparison to;
    to.score = from.score();
    to.signatureScore = from.signature_score();
    to.explanation = fromWire(from.explanation());
    to.query = fromWire(from.query());
    to.other = fromWire(from.other());
    if (from.has_fit()) to.fit = fromWire(from.fit());
    to.verdict = wire::fromProto(from.verdict());
    to.verdictReliability = from.verdict_reliability();
    to.unit = wire::fromProto(from.unit()).value_or(LengthUnit::kNone);
    to.leftRightUntold = from.left_right_untold();
    return to;
}

SearchReply fromWire(const v1::SearchResponse& from) {
    SearchReply to;
    for (const v1::Hit& hit : from.hits()) {
        Hit out;
        out.shape = fromWire(hit.shape());
        out.score = hit.score();
        out.signatureScore = hit.signature_score();
        if (hit.has_explanation()) out.explanation = fromWire(hit.explanation());
        if (hit.has_fit()) out.fit = fromWire(hit.fit());
        out.verdict = wire::fromProto(hit.verdict());
        out.verdictReliability = hit.verdict_reliability();
        to.hits.push_back(std::move(out));
    }
    for (const v1::HitGroup& group : from.groups()) {
        HitGroup out;
        if (group.has_value()) out.value = group.value();
        out.hits = group.hits();
        to.groups.push_back(std::move(out));
    }
    to.candidates = from.candidates();
    to.filtered = from.filtered();
    to.scored = from.scored();
    to.verified = from.candidates_verified();
    to.exact = !from.not_exact();
    to.pending = from.pending();
    to.unit = wire::fromProto(from.unit()).value_or(LengthUnit::kNone);
    to.leftRightUntold = from.left_right_untold();
    to.covered = from.covered();
    to.query = fromWire(from.query());
    to.secondsSegment = from.seconds_segment();
    to.secondsSearch = from.seconds_search();
    if (from.has_report()) to.report = fromWire(from.report());
    return to;
}

Collection fromWire(const v1::Collection& from) {
    Collection to;
    to.name = from.name();
    to.description = from.description();
    to.parameters.profile = wire::fromProto(from.profile()).value_or(Profile::kDefault);
    const v1::SegmentationParameters& segmentation = from.segmentation();
    to.parameters.bigBallRatio = segmentation.big_ball_ratio();
    to.parameters.deepAngleDegrees = segmentation.deep_angle_degrees();
    to.parameters.hullAngleDegrees = segmentation.hull_angle_degrees();
    to.parameters.mergeRatio = segmentation.merge_ratio();
    to.parameters.decimateTo = segmentation.decimate_to();
    to.parameters.mergeContrast = segmentation.merge_contrast();
    to.parameters.minSegmentShare = segmentation.min_segment_share();
    to.parameters.maxSegments = segmentation.max_segments();
    to.parameters.outlierRatio = segmentation.outlier_ratio();
    to.parameters.smoothingReach = segmentation.smoothing_reach();
    to.parameters.thinning = segmentation.thinning();
    to.parameters.interiorMethod =
        wire::fromProto(segmentation.interior_method()).value_or(InteriorMethod::kWalk);
    to.parameters.maxPoints = from.signature().max_points();
    to.parameters.attributes = from.signature().attributes();
    to.parameters.views = from.signature().views();
    to.parameters.unit = wire::fromProto(from.signature().unit()).value_or(LengthUnit::kNone);
    to.generation = from.generation();
    to.aliases.assign(from.aliases().begin(), from.aliases().end());
    to.created = fromWire(from.created());
    to.shapes = from.shapes();
    to.shapesReady = from.shapes_ready();
    to.shapesFailed = from.shapes_failed();
    to.damage = from.damage();
    return to;
}

RebuildProgress fromWire(const v1::RebuildProgress& from) {
    return {from.collection(), from.done(), from.total(), from.failed(), from.finished(), from.seconds()};
}

Stats fromWire(const v1::StatsResponse& from) {
    Stats to;
    to.collections = from.collections();
    to.shapesPending = from.shapes_pending();
    to.shapesReady = from.shapes_ready();
    to.shapesFailed = from.shapes_failed();
    to.cachedSignatures = from.cached_signatures();
    to.cacheBytes = from.cache_bytes();
    to.queuedJobs = from.queued_jobs();
    to.queuedBytes = from.queued_bytes();
    to.runningJobs = from.running_jobs();
    to.databaseBytes = from.database_bytes();
    to.walBytes = from.wal_bytes();
    to.missingCommits = from.missing_commits();
    to.pointBytes = from.point_bytes();
    to.storedPointBytes = from.stored_point_bytes();
    to.uptimeSeconds = from.uptime_seconds();
    to.searches = from.searches();
    to.ingested = from.ingested();
    return to;
}

ServerInfo fromWire(const v1::ServerInfoResponse& from) {
    ServerInfo to;
    to.version = from.version();
    to.schemaVersion = from.schema_version();
    to.started = fromWire(from.started());
    to.limits = {from.limits().max_points(),       from.limits().max_k(),
                 from.limits().max_batch(),        from.limits().max_queued_jobs(),
                 from.limits().max_queued_bytes(), from.limits().max_chunk_bytes()};
    for (const v1::Limit& limit : from.limit_table()) {
        to.limitTable.push_back({limit.name(), limit.value(), limit.unit(), limit.bounds(), limit.refusal()});
    }
    to.ingestThreads = from.ingest_threads();
    return to;
}

}  // namespace shapedb::client
