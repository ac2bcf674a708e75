// SPDX-License-Identifier: GPL-3.0-or-later
// Copies a collection from one database to another, some shapes at a time: exports and imports share it.
// Functions throw Failure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/store/sql/connection.h"
#include "server/store/store.h"

namespace shapedb::store {

/// A shape with all that belongs to it. Its job is not copied: queuePending makes new ones.
struct CopiedShape {
    Shape shape;  ///< with the id that it has in the source
    std::uint64_t pointBytes = 0;
    std::string points;  ///< as stored (point_blob.h)
    std::optional<SignatureRow> signature;
    std::optional<SurfaceRow> surface;
};

/// The next shapes of the collection with id > `afterId`, in ascending order of id: few and small enough for
/// one transaction, or one large one. Empty at the end. Throws Failure kDataLoss.
[[nodiscard]] std::vector<CopiedShape> nextShapes(Connection& source, const Collection& collection,
                                                  std::int64_t afterId);

/// In the caller's transaction. Returns the new id.
std::int64_t insertCollection(Connection& target, const Collection& collection, const std::string& name);
void insertCopy(Connection& target, std::int64_t collectionId, const CopiedShape& copied);

/// Queues a job for each pending shape of the collection, which must have none; in the caller's transaction.
void queuePending(Connection& connection, std::int64_t collectionId, TimestampMs now);

/// Bytes that are in memory; they must outlive it.
[[nodiscard]] BlobSource sourceOf(const std::string& bytes);

[[nodiscard]] std::uint64_t countShapesOf(Connection& connection, std::int64_t collectionId);

/// Copies the collection, as `source` shows it now, with jobs for its pending shapes, in transactions of
/// `target` alone. Reports the stage "export" in shapes. Throws Failure.
void copyCollection(Connection& source, const Collection& collection, Connection& target, TimestampMs now,
                    const RunContext& context);

/// Deletes the first shapes of the collection, as many as one transaction should, and the collection if these
/// were all. Returns whether they were; in the caller's transaction.
bool deleteSome(Connection& connection, std::int64_t collectionId);

}  // namespace shapedb::store
