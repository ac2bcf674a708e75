// SPDX-License-Identifier: GPL-3.0-or-later
// From rows to the structs of store.h, and small reads that several files share.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "server/store/sql/connection.h"
#include "server/store/sql/sql.h"
#include "server/store/store.h"

namespace shapedb::store {

// Columns of SHAPEDB_SHAPE_COLUMNS.
inline constexpr int kColumnMetadataName = 15;
inline constexpr int kColumnMetadataValue = 16;

/// Columns 0 to 14 of the current row; metadata stays empty. Throws Failure kDataLoss for values that
/// the store never writes.
Shape readShape(const Query& query);

/// Groups the rows of a SHAPEDB_SHAPE_COLUMNS statement into shapes and calls `visit(shape)` for each
/// until it returns false.
template <typename Visit>
void forEachShape(Query& query, Visit visit) {
    bool more = query.step();
    while (more) {
        Shape shape = readShape(query);
        do {
            if (!query.isNull(kColumnMetadataName)) {
                shape.metadata.emplace(query.text(kColumnMetadataName), query.text(kColumnMetadataValue));
            }
            more = query.step();
        } while (more && query.integer(0) == shape.id);
        if (!visit(std::move(shape))) return;
    }
}

std::optional<Shape> findShape(Connection& connection, std::int64_t collectionId, const std::string& key);
std::optional<Shape> findShapeById(Connection& connection, std::int64_t shapeId);
/// A shape that was deleted with this expected version, as it was.
std::optional<Shape> findDeletion(Connection& connection, std::int64_t collectionId, const std::string& key,
                                  std::int64_t version);
/// Throws Failure kNotFound.
Collection requireCollection(Connection& connection, std::int64_t collectionId);
std::optional<Collection> findCollection(Connection& connection, const std::string& name);
/// Throws Failure kAlreadyExists (a collection or an alias has the name).
void requireFreeName(Connection& connection, const std::string& name);
Collection readCollection(const Query& query);

/// Reads points_version, generation, digest, bytes and views from `column` on and verifies the digest. Throws
/// Failure kDataLoss, naming the shape.
SignatureRow readSignature(Connection& connection, const Query& query, int column, std::int64_t shapeId);

/// Appends shapes of a SHAPEDB_INDEX_COLUMNS statement, all or until there are `limit`. Throws Failure
/// kDataLoss, naming the shape.
void readIndexRows(Connection& connection, Query& query, std::vector<IndexRow>& rows,
                   std::size_t limit = std::numeric_limits<std::size_t>::max());

/// Replaces the shape's signature of that generation, and its surface points if the row brings some.
void putSignature(Connection& connection, const SignatureRow& signature);

/// The surface points of a kSurfaceOfShape row, verified; empty if there are none. Throws Failure kDataLoss,
/// naming the shape.
std::optional<SurfaceRow> readSurface(const Query& query);

/// Columns named digest: the first eight bytes of the SHA-256 of `first` followed by `second`, little-endian.
/// Persisted.
std::int64_t digestOf(const std::string& first, const std::string& second = {});

/// Three columns from `column` on.
Point3 readPoint(const Query& query, int column);

/// Decodes the points of columns 0 to 3 of a kLoadPoints row and verifies their checksum. Throws Failure.
std::vector<float> readPoints(const Query& query);

/// What is counted of the content; the rest stays 0. Throws Failure.
StoreStats readStats(Connection& connection);

/// Jobs queued and running. Throws Failure kDataLoss.
QueueDepth readTally(Connection& connection);

}  // namespace shapedb::store
