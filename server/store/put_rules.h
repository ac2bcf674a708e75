// SPDX-License-Identifier: GPL-3.0-or-later
// What a put may do, whichever database keeps the shapes: the rules of PutRequest in store.h and the
// messages of their errors. A store reads what it holds, asks here, and writes, in one transaction.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/store/store.h"

namespace shapedb::store {

/// What the put changes; `existing` is the shape that has the key now, null when the key is free.
/// Errors: kNotFound, kAlreadyExists, kVersionConflict and those of request.checkMetadata, as
/// Store::putShape.
[[nodiscard]] Result<PutOutcome> decidePut(const PutRequest& request, const std::string& collectionName,
                                           const Shape* existing);

/// `actual` is the version of the shape with this key, 0 when there is none. Errors: kVersionConflict,
/// which names both versions.
[[nodiscard]] Result<void> requireVersion(const std::string& key, std::int64_t actual,
                                          std::optional<std::int64_t> expected);

/// Whether the job of a scan of `bytes` fits into the queue beside `others`: all jobs but the one that it
/// replaces. Bounds as in PutRequest. Errors: kQueueFull.
[[nodiscard]] Result<void> requireRoom(std::uint64_t bytes, std::uint64_t maxQueuedJobs,
                                       std::uint64_t maxQueuedBytes, const QueueDepth& others);

/// kNotFound for a key.
[[nodiscard]] Error noSuchShape(const std::string& collectionName, const std::string& key);

}  // namespace shapedb::store
