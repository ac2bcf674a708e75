// SPDX-License-Identifier: Apache-2.0
// Between the values of types.h and the messages of the API. Not installed.
//
// Values that only a newer server knows (an unknown state, too few extents) become the nearest harmless ones.
#pragma once

#include "client/api/types.h"
#include "common/wire_enums.h"
#include "common/wire_vector.h"
#include "shapedb/v1/admin_service.pb.h"
#include "shapedb/v1/collection_service.pb.h"
#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/shape_service.pb.h"

namespace shapedb::client {

void fill(const ShapeRef& from, v1::ShapeRef* to);
void fill(const SearchOptions& from, v1::SearchOptions* to);

/// Sets the three fields that each request has for parameters.
template <typename Message>
void fillParameters(const Parameters& from, Message* to) {
    if (from.profile) to->set_profile(wire::toProto(*from.profile));
    if (from.bigBallRatio) to->mutable_segmentation()->set_big_ball_ratio(*from.bigBallRatio);
    if (from.deepAngleDegrees) to->mutable_segmentation()->set_deep_angle_degrees(*from.deepAngleDegrees);
    if (from.hullAngleDegrees) to->mutable_segmentation()->set_hull_angle_degrees(*from.hullAngleDegrees);
    if (from.mergeRatio) to->mutable_segmentation()->set_merge_ratio(*from.mergeRatio);
    if (from.decimateTo) to->mutable_segmentation()->set_decimate_to(*from.decimateTo);
    if (from.mergeContrast) to->mutable_segmentation()->set_merge_contrast(*from.mergeContrast);
    if (from.minSegmentShare) to->mutable_segmentation()->set_min_segment_share(*from.minSegmentShare);
    if (from.maxSegments) to->mutable_segmentation()->set_max_segments(*from.maxSegments);
    if (from.outlierRatio) to->mutable_segmentation()->set_outlier_ratio(*from.outlierRatio);
    if (from.smoothingReach) to->mutable_segmentation()->set_smoothing_reach(*from.smoothingReach);
    if (from.thinning) to->mutable_segmentation()->set_thinning(*from.thinning);
    if (from.interiorMethod) {
        to->mutable_segmentation()->set_interior_method(wire::toProto(*from.interiorMethod));
    }
    if (from.maxPoints) to->mutable_signature()->set_max_points(*from.maxPoints);
    if (from.attributes) to->mutable_signature()->set_attributes(*from.attributes);
    if (from.views) to->mutable_signature()->set_views(*from.views);
    if (from.unit) to->mutable_signature()->set_unit(wire::toProto(*from.unit));
}

[[nodiscard]] v1::AddMode toWire(AddMode mode);
[[nodiscard]] v1::ShapeState toWire(const std::optional<ShapeState>& state);
[[nodiscard]] v1::ShapeOrder toWire(ShapeOrder order);
void fill(const MetadataChange& from, v1::MetadataChange* to);
void fill(const ShapeSelection& from, v1::ShapeSelection* to);

[[nodiscard]] Timestamp fromWire(const google::protobuf::Timestamp& from);
[[nodiscard]] google::protobuf::Timestamp toWire(Timestamp from);
[[nodiscard]] Shape fromWire(const v1::Shape& from);
/// The shape of an answer that says its change: AddShape, GetShape, DeleteShape.
template <typename Response>
[[nodiscard]] Shape shapeOf(const Response& from) {
    Shape to = fromWire(from.shape());
    to.change = from.change();
    return to;
}
[[nodiscard]] Error fromWire(const v1::Failure& from);
[[nodiscard]] AddOutcome fromWire(v1::AddShapeResponse::Outcome from);
[[nodiscard]] IngestEvent fromWire(const v1::IngestEvent& from);
[[nodiscard]] Signature fromWire(const v1::Signature& from);
[[nodiscard]] SegmentationReport fromWire(const v1::SegmentationReport& from);
[[nodiscard]] Explanation fromWire(const v1::Explanation& from);
[[nodiscard]] Fit fromWire(const v1::Fit& from);
[[nodiscard]] Comparison fromWire(const v1::CompareResponse& from);
[[nodiscard]] SearchReply fromWire(const v1::SearchResponse& from);
[[nodiscard]] Collection fromWire(const v1::Collection& from);
[[nodiscard]] RebuildProgress fromWire(const v1::RebuildProgress& from);
[[nodiscard]] Stats fromWire(const v1::StatsResponse& from);
[[nodiscard]] ServerInfo fromWire(const v1::ServerInfoResponse& from);

}  // namespace shapedb::client
