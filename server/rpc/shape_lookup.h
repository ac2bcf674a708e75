// What several handlers do with one shape.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/services.h"

namespace shapedb::rpc {

/// A shape and the collection it was looked up in.
struct FoundShape {
    index::SnapshotPtr collection;
    store::Shape shape;
};

/// Errors: kNotFound (collection or key, named), kInvalidArgument (key).
[[nodiscard]] Result<FoundShape> findShape(const Services& services, Call& call, const pb::ShapeRef& ref);

/// The stored signature of a shape that searches of its collection find. Errors: kNotReady, saying
/// whether it is pending, why it failed or that a rebuild is being put in place; kDataLoss.
[[nodiscard]] Result<Signature> findSignature(const Services& services, const FoundShape& found);

/// The stored signature behind a hit: what the index searched leaves out. Errors: kNotFound, kNotReady
/// (also: of another generation than `searched`), kDataLoss.
[[nodiscard]] Result<Signature> storedSignature(const Services& services, const index::Snapshot& searched,
                                                std::int64_t shapeId);

/// How well the interior of a shape that searches find could be told, [0, 1]; empty when there is no
/// such shape or its profile does not say.
[[nodiscard]] std::optional<double> servingQuality(const Services& services, const store::Shape& shape);
[[nodiscard]] std::optional<double> qualityIn(const SignatureSet& signatures, std::int64_t shapeId);

/// Follows a shape until it is no longer pending, and when it is ready searches find it; calls `onChange`
/// with its row and where the work stands, at once and after each change. Returns the final row. Errors:
/// kNotFound (deleted meanwhile), what `onChange` and `checkpoint` return.
[[nodiscard]] Result<store::Shape> followIngest(
    const Services& services, std::int64_t shapeId, const std::function<Result<void>()>& checkpoint,
    const std::function<Result<void>(const store::Shape&, const ingest::ProgressBoard::Status&)>& onChange);

}  // namespace shapedb::rpc
