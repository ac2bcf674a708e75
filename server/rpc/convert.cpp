#include "server/rpc/convert.h"

#include <string>

#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"

namespace shapedb::rpc {
namespace {

void toProto(const Point3& p, pb::Vector3* out) {
    out->set_x(p.x);
    out->set_y(p.y);
    out->set_z(p.z);
}

pb::Profile toProto(Profile profile) {
    switch (profile) {
        case Profile::kPaper: return pb::PROFILE_PAPER;
        case Profile::kDefault: return pb::PROFILE_DEFAULT;
    }
    return pb::PROFILE_DEFAULT;
}

pb::InteriorMethod toProto(InteriorMethod method) {
    switch (method) {
        case InteriorMethod::kWalk: return pb::INTERIOR_METHOD_WALK;
        case InteriorMethod::kAdaptive: return pb::INTERIOR_METHOD_ADAPTIVE;
    }
    return pb::INTERIOR_METHOD_WALK;
}

pb::InteriorSource toProto(InteriorSource source) {
    switch (source) {
        case InteriorSource::kWalk: return pb::INTERIOR_SOURCE_WALK;
        case InteriorSource::kPotential: return pb::INTERIOR_SOURCE_POTENTIAL;
        case InteriorSource::kThickened: return pb::INTERIOR_SOURCE_THICKENED;
    }
    return pb::INTERIOR_SOURCE_UNSPECIFIED;
}

tl::unexpected<Error> unknownNumber(const char* field, int value) {
    return fail(ErrorCode::kInvalidArgument,
                std::string(field) + ": " + std::to_string(value) + " is not a value this server knows");
}

}  // namespace

void toProto(store::TimestampMs time, google::protobuf::Timestamp* out) {
    // Rounds towards the past: nanos must not be negative, before 1970 either.
    store::TimestampMs seconds = time / 1'000;
    store::TimestampMs rest = time % 1'000;
    if (rest < 0) seconds -= 1, rest += 1'000;
    out->set_seconds(seconds);
    out->set_nanos(static_cast<std::int32_t>(rest * 1'000'000));
}

pb::ShapeState toProto(store::ShapeState state) {
    switch (state) {
        case store::ShapeState::kPending: return pb::SHAPE_STATE_PENDING;
        case store::ShapeState::kReady: return pb::SHAPE_STATE_READY;
        case store::ShapeState::kFailed: return pb::SHAPE_STATE_FAILED;
    }
    return pb::SHAPE_STATE_UNSPECIFIED;
}

void toProto(const Error& failure, pb::Failure* out) {
    out->set_error(errorCodeName(failure.code));
    out->set_message(failure.message);
}

void toProto(const store::Shape& shape, const std::string& collection, std::optional<double> quality,
             pb::Shape* out) {
    out->set_collection(collection);
    out->set_key(shape.key);
    out->set_id(shape.id);
    out->set_version(shape.version);
    out->set_state(toProto(shape.state));
    out->set_point_count(shape.pointCount);
    out->set_sha256(shape.checksum.data(), shape.checksum.size());
    for (const auto& [key, value] : shape.metadata) (*out->mutable_metadata())[key] = value;
    toProto(shape.createdAt, out->mutable_created());
    toProto(shape.updatedAt, out->mutable_updated());
    if (shape.failure) toProto(*shape.failure, out->mutable_failure());
    if (quality) out->set_quality(*quality);
}

void toProto(const store::Collection& collection, const ShapeParameters& parameters, pb::Collection* out) {
    out->set_name(collection.name);
    out->set_description(collection.description);
    out->set_profile(toProto(parameters.profile));
    pb::SegmentationParameters* segmentation = out->mutable_segmentation();
    segmentation->set_big_ball_ratio(parameters.segmentation.bigBallRatio);
    segmentation->set_deep_angle_degrees(parameters.segmentation.deepAngleDegrees);
    segmentation->set_hull_angle_degrees(parameters.segmentation.hullAngleDegrees);
    segmentation->set_merge_ratio(parameters.segmentation.mergeRatio);
    segmentation->set_decimate_to(parameters.segmentation.preparation.decimateTo);
    segmentation->set_merge_contrast(parameters.segmentation.mergeContrast);
    segmentation->set_min_segment_share(parameters.segmentation.minSegmentShare);
    segmentation->set_max_segments(parameters.segmentation.maxSegments);
    segmentation->set_outlier_ratio(parameters.segmentation.preparation.outlierRatio);
    segmentation->set_smoothing_reach(parameters.segmentation.preparation.smoothingReach);
    segmentation->set_thinning(parameters.segmentation.preparation.thinning);
    segmentation->set_interior_method(toProto(parameters.segmentation.interiorMethod));
    out->mutable_signature()->set_max_points(parameters.signature.maxPoints);
    out->mutable_signature()->set_attributes(parameters.signature.attributes);
    out->set_generation(collection.generation);
    toProto(collection.createdAt, out->mutable_created());
}

void toProto(const ShapeAttributes& attributes, pb::ShapeAttributes* out) {
    out->set_quality(attributes.quality / 255.0);
    for (const StatisticLayout& layout : kStatistics) {
        pb::ShapeStatistic* statistic = out->add_statistics();
        statistic->set_name(layout.name);
        statistic->set_of_interior(layout.evidence == Evidence::kInside);
        for (std::size_t i = layout.offset; i < std::size_t{layout.offset} + layout.count; ++i) {
            statistic->add_shares(static_cast<float>(shareOfLevel(attributes.statistics[i])));
        }
    }
}

void toProto(const Signature& signature, pb::Signature* out) {
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        const WeightedPoint& point = signature.points[i];
        pb::WeightedPoint* weighted = out->add_points();
        toProto(pointPosition(signature, i), weighted->mutable_position());
        weighted->set_weight(pointVolume(signature, i));
        weighted->set_volume_share(point.volumeShare);
        weighted->set_peak_radius(static_cast<double>(point.maximumRadius) * signature.scale);
        for (const double extent : pointExtents(signature, i)) weighted->add_extents(extent);
    }
    out->set_scale(signature.scale);
    out->set_volume(signature.volume);
    out->set_encoded(encodeSignature(signature));
    if (signature.attributes) toProto(*signature.attributes, out->mutable_attributes());
}

void toProto(const Segmentation& segmentation, pb::SegmentationReport* out) {
    out->set_points(segmentation.siteOfPoint.size());
    out->set_points_used(segmentation.sites.size());
    out->set_duplicates(segmentation.duplicates);
    out->set_outliers(segmentation.outliers);
    out->set_quality(segmentation.quality);
    out->set_interior_source(toProto(segmentation.interiorSource));
    out->set_angle_degrees(segmentation.angleDegrees);
    out->set_noise(segmentation.noise);
    out->set_tetrahedra(segmentation.tetrahedra.size());
    out->set_interior_tetrahedra(segmentation.interiorTetrahedra);
    out->set_maxima(segmentation.maxima);
    out->set_segments(segmentation.segments.size());
    out->set_volume(segmentation.volume);
    out->set_delaunay_seconds(segmentation.delaunaySeconds);
    out->set_total_seconds(segmentation.totalSeconds);
    for (const StageTime& stage : segmentation.stages) {
        pb::StageTime* time = out->add_stages();
        time->set_stage(stage.stage);
        time->set_seconds(stage.seconds);
    }
}

void toProto(const Explanation& explanation, pb::Explanation* out) {
    out->set_similarity(explanation.similarity);
    out->set_dissimilarity(explanation.dissimilarity);
    pb::Motion* motion = out->mutable_motion();
    for (const auto& row : explanation.motion.rotation) {
        for (const double entry : row) motion->add_rotation(entry);
    }
    motion->set_scale(explanation.motion.scale);
    toProto(explanation.motion.translation, motion->mutable_translation());
    motion->set_reflected(explanation.motion.reflected);
    for (const PointMatch& match : explanation.matches) {
        pb::SegmentMatch* pair = out->add_matches();
        pair->set_query_segment(match.a);
        pair->set_hit_segment(match.b);
        pair->set_share(match.share);
        pair->set_distance(match.distance);
    }
    for (const std::uint32_t segment : explanation.unmatchedA) out->add_unmatched_query(segment);
    for (const std::uint32_t segment : explanation.unmatchedB) out->add_unmatched_hit(segment);
    out->set_degenerate(explanation.degenerate);
    for (const ScoreTerm& term : explanation.terms) {
        pb::ScoreTerm* part = out->add_terms();
        part->set_name(term.name);
        part->set_distance(term.distance);
        part->set_weight(term.weight);
    }
}

Result<std::optional<store::ShapeState>> fromProto(pb::ShapeState state) {
    using State = std::optional<store::ShapeState>;
    switch (static_cast<int>(state)) {
        case pb::SHAPE_STATE_UNSPECIFIED: return State();
        case pb::SHAPE_STATE_PENDING: return State(store::ShapeState::kPending);
        case pb::SHAPE_STATE_READY: return State(store::ShapeState::kReady);
        case pb::SHAPE_STATE_FAILED: return State(store::ShapeState::kFailed);
        default: return unknownNumber("state", state);
    }
}

Result<store::PutMode> fromProto(pb::AddMode mode) {
    switch (static_cast<int>(mode)) {
        case pb::ADD_MODE_UNSPECIFIED:
        case pb::ADD_MODE_UPSERT: return store::PutMode::kUpsert;
        case pb::ADD_MODE_INSERT_ONLY: return store::PutMode::kInsertOnly;
        case pb::ADD_MODE_UPDATE_ONLY: return store::PutMode::kUpdateOnly;
        default: return unknownNumber("mode", mode);
    }
}

Result<ShapeParameters> parametersFrom(pb::Profile profile, const pb::SegmentationParameters& segmentation,
                                       const pb::SignatureParameters& signature,
                                       const ShapeParameters& current) {
    ShapeParameters parameters = current;
    switch (static_cast<int>(profile)) {
        case pb::PROFILE_UNSPECIFIED: break;
        case pb::PROFILE_DEFAULT: parameters = parametersOf(Profile::kDefault); break;
        case pb::PROFILE_PAPER: parameters = parametersOf(Profile::kPaper); break;
        default: return unknownNumber("profile", profile);
    }
    SegmentationOptions& options = parameters.segmentation;
    if (segmentation.has_big_ball_ratio()) options.bigBallRatio = segmentation.big_ball_ratio();
    if (segmentation.has_deep_angle_degrees()) options.deepAngleDegrees = segmentation.deep_angle_degrees();
    if (segmentation.has_hull_angle_degrees()) options.hullAngleDegrees = segmentation.hull_angle_degrees();
    if (segmentation.has_merge_ratio()) options.mergeRatio = segmentation.merge_ratio();
    if (segmentation.has_decimate_to()) options.preparation.decimateTo = segmentation.decimate_to();
    if (segmentation.has_merge_contrast()) options.mergeContrast = segmentation.merge_contrast();
    if (segmentation.has_min_segment_share()) options.minSegmentShare = segmentation.min_segment_share();
    if (segmentation.has_max_segments()) options.maxSegments = segmentation.max_segments();
    if (segmentation.has_outlier_ratio()) options.preparation.outlierRatio = segmentation.outlier_ratio();
    if (segmentation.has_smoothing_reach())
        options.preparation.smoothingReach = segmentation.smoothing_reach();
    if (segmentation.has_thinning()) options.preparation.thinning = segmentation.thinning();
    switch (static_cast<int>(segmentation.interior_method())) {
        case pb::INTERIOR_METHOD_UNSPECIFIED: break;
        case pb::INTERIOR_METHOD_WALK: options.interiorMethod = InteriorMethod::kWalk; break;
        case pb::INTERIOR_METHOD_ADAPTIVE: options.interiorMethod = InteriorMethod::kAdaptive; break;
        default: return unknownNumber("interior_method", segmentation.interior_method());
    }
    if (signature.has_max_points()) parameters.signature.maxPoints = signature.max_points();
    if (signature.has_attributes()) parameters.signature.attributes = signature.attributes();
    RETURN_IF_ERROR(validate(parameters));
    return parameters;
}

Metadata toMetadata(const google::protobuf::Map<std::string, std::string>& metadata) {
    return {metadata.begin(), metadata.end()};
}

}  // namespace shapedb::rpc
