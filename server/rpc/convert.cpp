// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/convert.h"

#include <algorithm>
#include <string>

namespace shapedb::rpc {
namespace {

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

store::TimestampMs fromProto(const google::protobuf::Timestamp& time) {
    // Further than any rule allows, and small enough to count in milliseconds.
    constexpr std::int64_t kFar = std::int64_t{1} << 50;
    return std::clamp(time.seconds(), -kFar, kFar) * 1'000 +
           std::clamp(time.nanos(), 0, 999'999'999) / 1'000'000;
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
    if (shape.origin != Point3{}) toProto(shape.origin, out->mutable_origin());
    for (const auto& [key, value] : shape.metadata) (*out->mutable_metadata())[key] = value;
    toProto(shape.createdAt, out->mutable_created());
    toProto(shape.updatedAt, out->mutable_updated());
    if (shape.failure) toProto(*shape.failure, out->mutable_failure());
    // A shape that waits with new points is still found by its older ones, whose quality is not that of
    // these.
    if (quality && shape.state == store::ShapeState::kReady) out->set_quality(*quality);
}

void toProto(const store::Collection& collection, const ShapeParameters& parameters, pb::Collection* out) {
    out->set_name(collection.name);
    out->set_description(collection.description);
    out->set_profile(toProto(parameters.profile));
    toProto(parameters, out->mutable_segmentation(), out->mutable_signature());
    out->set_generation(collection.generation);
    toProto(collection.createdAt, out->mutable_created());
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

Result<store::ShapeOrder> fromProto(pb::ShapeOrder order) {
    switch (static_cast<int>(order)) {
        case pb::SHAPE_ORDER_UNSPECIFIED:
        case pb::SHAPE_ORDER_ID: return store::ShapeOrder::kId;
        case pb::SHAPE_ORDER_KEY: return store::ShapeOrder::kKey;
        case pb::SHAPE_ORDER_UPDATED: return store::ShapeOrder::kUpdated;
        default: return unknownNumber("order", order);
    }
}

store::MetadataChange fromProto(const pb::MetadataChange& change) {
    return {toMetadata(change.set()), {change.remove().begin(), change.remove().end()}, change.replace_all()};
}

catalog::ChangeTarget fromProto(const pb::ShapeSelection& selection) {
    catalog::ChangeTarget target;
    if (selection.has_keys()) {
        target.keys.emplace(selection.keys().keys().begin(), selection.keys().keys().end());
    }
    if (selection.has_filter()) target.filter = selection.filter();
    return target;
}

Result<store::PutMode> fromProto(pb::AddMode mode) {
    switch (static_cast<int>(mode)) {
        case pb::ADD_MODE_UNSPECIFIED:
        case pb::ADD_MODE_UPSERT: return store::PutMode::kUpsert;
        case pb::ADD_MODE_INSERT_ONLY: return store::PutMode::kInsertOnly;
        case pb::ADD_MODE_UPDATE_ONLY: return store::PutMode::kUpdateOnly;
        case pb::ADD_MODE_SAME_POINTS: return store::PutMode::kSamePoints;
        default: return unknownNumber("mode", mode);
    }
}

Result<catalog::ParameterOverrides> overridesFrom(pb::Profile profile,
                                                  const pb::SegmentationParameters& segmentation,
                                                  const pb::SignatureParameters& signature) {
    catalog::ParameterOverrides overrides;
    if (profile != pb::PROFILE_UNSPECIFIED) {
        overrides.profile = fromProto(profile);
        if (!overrides.profile) return unknownNumber("profile", profile);
    }
    if (segmentation.has_big_ball_ratio()) overrides.bigBallRatio = segmentation.big_ball_ratio();
    if (segmentation.has_deep_angle_degrees()) overrides.deepAngleDegrees = segmentation.deep_angle_degrees();
    if (segmentation.has_hull_angle_degrees()) overrides.hullAngleDegrees = segmentation.hull_angle_degrees();
    if (segmentation.has_merge_ratio()) overrides.mergeRatio = segmentation.merge_ratio();
    if (segmentation.has_merge_contrast()) overrides.mergeContrast = segmentation.merge_contrast();
    if (segmentation.has_min_segment_share()) overrides.minSegmentShare = segmentation.min_segment_share();
    if (segmentation.has_max_segments()) overrides.maxSegments = segmentation.max_segments();
    if (segmentation.has_decimate_to()) overrides.decimateTo = segmentation.decimate_to();
    if (segmentation.has_outlier_ratio()) overrides.outlierRatio = segmentation.outlier_ratio();
    if (segmentation.has_smoothing_reach()) overrides.smoothingReach = segmentation.smoothing_reach();
    if (segmentation.has_thinning()) overrides.thinning = segmentation.thinning();
    if (const auto method = segmentation.interior_method(); method != pb::INTERIOR_METHOD_UNSPECIFIED) {
        overrides.interiorMethod = fromProto(method);
        if (!overrides.interiorMethod) return unknownNumber("interior_method", method);
    }
    if (signature.has_max_points()) overrides.maxPoints = signature.max_points();
    if (signature.has_attributes()) overrides.attributes = signature.attributes();
    if (signature.has_views()) overrides.views = signature.views();
    if (signature.unit() != pb::LENGTH_UNIT_UNSPECIFIED) {
        overrides.unit = fromProto(signature.unit());
        if (!overrides.unit) {
            return fail(ErrorCode::kInvalidArgument,
                        "unit: unknown value " + std::to_string(static_cast<int>(signature.unit())));
        }
    }
    return overrides;
}

Metadata toMetadata(const google::protobuf::Map<std::string, std::string>& metadata) {
    return {metadata.begin(), metadata.end()};
}

}  // namespace shapedb::rpc
