// SPDX-License-Identifier: GPL-3.0-or-later
// The only conversion between the messages of the API and the types of core/ and store/.
#pragma once

#include <optional>

#include "common/wire.h"
#include "core/base/error.h"
#include "core/pipeline.h"
#include "server/catalog/bulk_changes.h"
#include "server/catalog/parameter_overrides.h"
#include "server/index/collection_index.h"
#include "server/store/store.h"
#include "shapedb/v1/collection_service.pb.h"
#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/shape_service.pb.h"
#include "shapedb/v1/types.pb.h"

namespace shapedb::rpc {

namespace pb = shapedb::v1;

// What core/ computes: common/wire.h.
using wire::fromProto;
using wire::toProto;

/// `quality`: of the serving signature, as Catalog::quality.
void toProto(const store::Shape& shape, const std::string& collection, std::optional<double> quality,
             pb::Shape* out);
[[nodiscard]] pb::ShapeState toProto(store::ShapeState state);
void toProto(const Error& failure, pb::Failure* out);
void toProto(const store::Collection& collection, const ShapeParameters& parameters, pb::Collection* out);
void toProto(store::TimestampMs time, google::protobuf::Timestamp* out);
/// Rounds towards the past. What is beyond 2^50 seconds becomes that; whether it is allowed is for others.
[[nodiscard]] store::TimestampMs fromProto(const google::protobuf::Timestamp& time);

/// Empty for UNSPECIFIED. Errors: kInvalidArgument (a number without a name).
[[nodiscard]] Result<std::optional<store::ShapeState>> fromProto(pb::ShapeState state);
/// UNSPECIFIED is by id. Errors: kInvalidArgument.
[[nodiscard]] Result<store::ShapeOrder> fromProto(pb::ShapeOrder order);
[[nodiscard]] store::MetadataChange fromProto(const pb::MetadataChange& change);
[[nodiscard]] catalog::ChangeTarget fromProto(const pb::ShapeSelection& selection);
/// UNSPECIFIED is upsert. Errors: kInvalidArgument.
[[nodiscard]] Result<store::PutMode> fromProto(pb::AddMode mode);

/// Each field that is set. Errors: kInvalidArgument (a number without a name).
[[nodiscard]] Result<catalog::ParameterOverrides> overridesFrom(
    pb::Profile profile, const pb::SegmentationParameters& segmentation,
    const pb::SignatureParameters& signature);

[[nodiscard]] Metadata toMetadata(const google::protobuf::Map<std::string, std::string>& metadata);

}  // namespace shapedb::rpc
