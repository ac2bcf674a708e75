// What several handlers do with one shape.
#pragma once

#include <cstdint>
#include <functional>
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

/// The cached signature of a shape. Errors: kNotReady, saying whether it is pending or why it failed.
[[nodiscard]] Result<SignatureSet::EntryPtr> findSignature(const FoundShape& found);

/// The signature that serves a shape now; null when there is none.
[[nodiscard]] SignatureSet::EntryPtr servingSignature(const Services& services, const store::Shape& shape);

/// Follows a shape until it is no longer pending, and when it is ready searches find it; calls `onChange`
/// with its row and where the work stands, at once and after each change. Returns the final row. Errors:
/// kNotFound (deleted meanwhile), what `onChange` and `checkpoint` return.
[[nodiscard]] Result<store::Shape> followIngest(
    const Services& services, std::int64_t shapeId, const std::function<Result<void>()>& checkpoint,
    const std::function<Result<void>(const store::Shape&, const ingest::ProgressBoard::Status&)>& onChange);

}  // namespace shapedb::rpc
