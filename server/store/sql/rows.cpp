// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sql/rows.h"

#include <algorithm>
#include <cstring>

#include "common/sha256.h"
#include "server/store/point_blob.h"

namespace shapedb::store {

namespace {

Checksum readChecksum(const Query& query, int column, const std::string& key) {
    const BlobView blob = query.blob(column);
    Checksum checksum{};
    if (blob.size != checksum.size()) {
        raise(ErrorCode::kDataLoss, "the stored checksum of shape " + quoted(key) + " is damaged");
    }
    std::memcpy(checksum.data(), blob.data, blob.size);
    return checksum;
}

ShapeState readState(const Query& query, int column, const std::string& key) {
    const std::int64_t value = query.integer(column);
    if (value < static_cast<int>(ShapeState::kPending) || value > static_cast<int>(ShapeState::kFailed)) {
        raise(ErrorCode::kDataLoss,
              "shape " + quoted(key) + " has the unknown state " + std::to_string(value));
    }
    return static_cast<ShapeState>(value);
}

}  // namespace

Point3 readPoint(const Query& query, int column) {
    return {query.real(column), query.real(column + 1), query.real(column + 2)};
}

Shape readShape(const Query& query) {
    Shape shape;
    shape.id = query.integer(0);
    shape.collectionId = query.integer(1);
    shape.key = query.text(2);
    shape.version = query.integer(3);
    shape.pointsVersion = query.integer(4);
    shape.state = readState(query, 5, shape.key);
    shape.pointCount = static_cast<std::uint64_t>(query.integer(6));
    shape.checksum = readChecksum(query, 7, shape.key);
    shape.createdAt = query.integer(8);
    shape.updatedAt = query.integer(9);
    if (shape.state == ShapeState::kFailed) {
        shape.failure = Error{errorCodeFromName(query.text(10)), query.text(11)};
    }
    shape.origin = readPoint(query, 12);
    return shape;
}

namespace {

std::optional<Shape> onlyShape(Query& query) {
    std::optional<Shape> found;
    forEachShape(query, [&](Shape&& shape) {
        found = std::move(shape);
        return false;
    });
    return found;
}

}  // namespace

std::optional<Shape> findShape(Connection& connection, std::int64_t collectionId, const std::string& key) {
    std::optional<Shape> found;
    lookUp(connection, sql::kShapeByKey, [&](const char* sql) {
        Query query(connection, sql, collectionId, key);
        found = onlyShape(query);
    });
    return found;
}

std::optional<Shape> findDeletion(Connection& connection, std::int64_t collectionId, const std::string& key,
                                  std::int64_t version) {
    Query query(connection, sql::kRememberedDeletion, collectionId, key, version);
    return onlyShape(query);
}

std::optional<Shape> findShapeById(Connection& connection, std::int64_t shapeId) {
    Query query(connection, sql::kShapeById, shapeId);
    return onlyShape(query);
}

Collection readCollection(const Query& query) {
    Collection collection;
    collection.id = query.integer(0);
    collection.name = query.text(1);
    collection.description = query.text(2);
    collection.parameters = query.text(3);
    collection.generation = query.integer(4);
    collection.createdAt = query.integer(5);
    return collection;
}

Collection requireCollection(Connection& connection, std::int64_t collectionId) {
    Query query(connection, sql::kCollectionById, collectionId);
    const auto none = [&] {
        raise(ErrorCode::kNotFound, "there is no collection with id " + std::to_string(collectionId));
    };
    if (!query.step()) none();
    Collection found = readCollection(query);
    if (sql::isDeleted(found.name)) none();
    return found;
}

std::optional<Collection> findCollection(Connection& connection, const std::string& name) {
    Query query(connection, sql::kCollectionByName, name);
    if (!query.step()) return std::nullopt;
    return readCollection(query);
}

std::int64_t digestOf(const std::string& first, const std::string& second) {
    Sha256 hash;
    hash.update(first.data(), first.size());
    hash.update(second.data(), second.size());
    const Sha256Digest digest = hash.finish();
    std::uint64_t value = 0;
    for (int i = 7; i >= 0; --i) value = value << 8 | digest[static_cast<std::size_t>(i)];
    return static_cast<std::int64_t>(value);
}

SignatureRow readSignature(Connection& connection, const Query& query, int column, std::int64_t shapeId) {
    SignatureRow row;
    row.shapeId = shapeId;
    row.pointsVersion = query.integer(column);
    row.generation = query.integer(column + 1);
    row.bytes = bytesOf(query.blob(column + 3));
    if (!query.isNull(column + 4)) row.views = bytesOf(query.blob(column + 4));
    if (digestOf(row.bytes, row.views) != query.integer(column + 2)) {
        const auto shape = findShapeById(connection, shapeId);
        raise(ErrorCode::kDataLoss,
              "the stored signature of shape " + (shape ? quoted(shape->key) : std::to_string(shapeId)) +
                  " is damaged; restore a backup, or delete the shape and add it again");
    }
    return row;
}

void readIndexRows(Connection& connection, Query& query, std::vector<IndexRow>& rows, std::size_t limit) {
    bool more = query.step();
    while (more && rows.size() < limit) {
        IndexRow& row = rows.emplace_back();
        row.shapeId = query.integer(0);
        row.signature = readSignature(connection, query, 3, row.shapeId);
        row.key = query.text(8);
        do {
            if (!query.isNull(1)) row.metadata.emplace(query.text(1), query.text(2));
            more = query.step();
        } while (more && query.integer(0) == row.shapeId);
    }
}

void putSignature(Connection& connection, const SignatureRow& signature) {
    Query(connection, sql::kPutSignature, signature.shapeId, signature.generation, signature.pointsVersion,
          digestOf(signature.bytes, signature.views), viewOf(signature.bytes),
          BlobOrNull{viewOf(signature.views)})
        .run();
    if (signature.surface.empty()) return;
    Query(connection, sql::kPutSurface, signature.shapeId, signature.pointsVersion,
          digestOf(signature.surface), viewOf(signature.surface))
        .run();
}

std::optional<SurfaceRow> readSurface(const Query& query) {
    if (query.isNull(1)) return std::nullopt;
    SurfaceRow row;
    row.pointsVersion = query.integer(1);
    row.bytes = bytesOf(query.blob(3));
    if (digestOf(row.bytes) != query.integer(2)) {
        raise(ErrorCode::kDataLoss, "the stored surface points of shape " + quoted(query.text(0)) +
                                        " are damaged; rebuild the collection");
    }
    return row;
}

std::vector<float> readPoints(const Query& query) {
    const std::string key = query.text(0);
    if (query.isNull(3)) raise(ErrorCode::kDataLoss, "the points of shape " + quoted(key) + " are missing");
    const BlobView blob = query.blob(3);
    const auto pointCount = static_cast<std::uint64_t>(query.integer(1));
    // A damaged count must not wrap around when multiplied.
    Result<std::vector<float>> points = pointCount > (std::uint64_t{1} << 40)
                                            ? fail(ErrorCode::kDataLoss, "the stored point count is damaged")
                                            : decodePoints(blob.data, blob.size, 3 * pointCount);
    if (!points) raise(points.error().code, "shape " + quoted(key) + ": " + points.error().message);
    if (sha256(points->data(), points->size() * sizeof(float)) != readChecksum(query, 2, key)) {
        raise(ErrorCode::kDataLoss,
              "the stored points of shape " + quoted(key) +
                  " do not match their checksum; restore a backup or add the shape again");
    }
    return std::move(*points);
}

QueueDepth readTally(Connection& connection) {
    Query tally(connection, sql::kTally);
    if (!tally.step()) raise(ErrorCode::kDataLoss, "the row of table tally is missing");
    return {static_cast<std::uint64_t>(tally.integer(0)), static_cast<std::uint64_t>(tally.integer(1))};
}

StoreStats readStats(Connection& connection) {
    StoreStats stats;
    const auto count = [&](const char* statement) {
        return static_cast<std::uint64_t>(numberOf(Query(connection, statement)));
    };
    stats.collections = count(sql::kCountCollections);
    stats.signatures = count(sql::kCountSignatures);
    Query states(connection, sql::kCountStates);
    while (states.step()) {
        const auto shapes = static_cast<std::uint64_t>(states.integer(1));
        switch (static_cast<ShapeState>(states.integer(0))) {
            case ShapeState::kPending: stats.shapesPending = shapes; break;
            case ShapeState::kReady: stats.shapesReady = shapes; break;
            case ShapeState::kFailed: stats.shapesFailed = shapes; break;
        }
    }
    Query tally(connection, sql::kTally);
    if (tally.step()) {
        stats.pointBytes = static_cast<std::uint64_t>(tally.integer(2));
        stats.storedPointBytes = static_cast<std::uint64_t>(tally.integer(3));
    }
    return stats;
}

}  // namespace shapedb::store
