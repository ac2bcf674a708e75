// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of many shapes of a collection, whatever the transport: which shapes a request means, how the work
// is divided, and what is reported to its caller.
//
// The shapes are found in reads, which hold up nobody, and changed in transactions of a few
// (kShapesPerChange). Each transaction looks at its shapes again: one that was deleted, or no longer passes
// the filter, is left alone. What was changed before an error stays changed, and the same call can be
// repeated. Shapes added after the call began are not looked for.
//
// Errors of every function: kInvalidArgument (which shapes are meant), kMalformedFilter, kCancelled,
// kDeadlineExceeded, kUnavailable (a restore replaced the content), those of the store.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/catalog.h"

namespace shapedb::catalog {

/// The shapes that a request means: exactly one is set.
struct ChangeTarget {
    std::optional<std::vector<std::string>> keys;  ///< 1 to kMaxKeys; those given twice count once
    std::optional<std::string> filter;             ///< docs/filters.md; empty text: all
};

struct BulkDeletion {
    std::uint64_t deleted = 0;
    std::vector<std::string> missing;  ///< keys that no shape had
};
[[nodiscard]] Result<BulkDeletion> deleteShapes(Catalog& catalog, const index::Snapshot& collection,
                                                const ChangeTarget& target, const RunContext& context);

struct BulkRetry {
    std::uint64_t queued = 0;
    std::uint64_t left = 0;              ///< failed shapes for which the queue had no room
    std::vector<std::string> notFailed;  ///< keys
    std::vector<std::string> missing;    ///< keys
};
/// By filter: of the shapes that pass, those that failed; whether they still pass is not asked again. Errors:
/// kQueueFull (no room for any).
[[nodiscard]] Result<BulkRetry> retryShapes(Catalog& catalog, const index::Snapshot& collection,
                                            const ChangeTarget& target, const RunContext& context);

struct BulkMetadata {
    std::uint64_t changed = 0;
    std::uint64_t unchanged = 0;  ///< had this metadata before
    std::uint64_t refused = 0;    ///< would have had more than a shape may have
    std::string firstRefusedKey;
    std::optional<Error> firstRefused;
};
/// Changes all shapes that pass the filter. A change that replaces all metadata leaves keys that begin with
/// kMetadataOfPoints alone. Errors: kInvalidArgument (the change).
[[nodiscard]] Result<BulkMetadata> changeMetadata(Catalog& catalog, const index::Snapshot& collection,
                                                  const std::string& filter,
                                                  const store::MetadataChange& change,
                                                  const RunContext& context);

struct ChangedShape {
    bool changed = false;  ///< false: it had this metadata before
    store::Shape shape;    ///< as it is now
};
/// Changes one shape. A repeated request whose reply was lost is recognised: the shape is one version further
/// than expected, and as requested. Errors: kInvalidArgument (key, the change, what the shape would have
/// after it), kNotFound, kVersionConflict.
[[nodiscard]] Result<ChangedShape> changeMetadataOf(Catalog& catalog, const index::SnapshotPtr& collection,
                                                    const std::string& key,
                                                    const store::MetadataChange& change,
                                                    const std::optional<std::int64_t>& expectedVersion);

}  // namespace shapedb::catalog
