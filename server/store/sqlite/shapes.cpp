// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes, their points and the signatures that serve.
#include <algorithm>

#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/point_blob.h"
#include "server/store/put_rules.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

// A caller may set no limit.
constexpr std::size_t kMostReserved = 4096;

[[noreturn]] void raiseNoShape(std::int64_t shapeId) {
    raise(ErrorCode::kNotFound, "there is no shape with id " + std::to_string(shapeId));
}

void writeMetadata(Connection& connection, std::int64_t shapeId, const Metadata& metadata) {
    for (const auto& [name, value] : metadata) {
        Query(connection, sql::kInsertMetadata, shapeId, name, value).run();
    }
}

void rewriteMetadata(Connection& connection, const Shape& existing, const Metadata& metadata) {
    if (existing.metadata == metadata) return;
    Query(connection, sql::kDeleteMetadata, existing.id).run();
    writeMetadata(connection, existing.id, metadata);
}

void writePoints(Connection& connection, std::int64_t shapeId, const PutRequest& request,
                 const PointEncoding& encoding) {
    const std::uint64_t bytes = request.scan.bytes();
    if (const std::string* blob = encoding.whole()) {
        Query(connection, sql::kInsertPoints, shapeId, bytes, blob->size(),
              BlobView{blob->data(), blob->size()})
            .run();
        return;
    }
    Query(connection, sql::kInsertPoints, shapeId, bytes, encoding.size(), ZeroBlob{encoding.size()}).run();
    BlobWriter writer(connection, "shape_points", "points", shapeId);
    encoding.write([&](const void* data, std::size_t size) { writer.append(data, size); });
}

BlobView view(const Checksum& checksum) { return {checksum.data(), checksum.size()}; }

// Slow, and right while the tables can be read: what a damaged index holds is in its table, too.
constexpr char kSignatureWithoutIndex[] =
    "SELECT s.key, s.state, s.failure_message, g.points_version, g.generation, g.digest, g.bytes, g.views "
    "FROM "
    "shape s NOT INDEXED JOIN collection c ON c.id = s.collection_id LEFT JOIN signature g NOT INDEXED ON "
    "g.shape_id = s.id AND g.generation = c.generation WHERE s.id = ?1";
constexpr char kRowsWithoutIndices[] =
    "SELECT g.rowid FROM signature g NOT INDEXED CROSS JOIN shape s NOT INDEXED ON s.id = g.shape_id WHERE "
    "s.collection_id = ?1 AND g.shape_id > ?2 AND g.generation = ?3 ORDER BY g.shape_id LIMIT ?4";
constexpr char kIndexRow[] =
    "SELECT g.shape_id, m.name, m.value, g.points_version, g.generation, g.digest, g.bytes, g.views, s.key "
    "FROM "
    "signature g NOT INDEXED CROSS JOIN shape s NOT INDEXED ON s.id = g.shape_id LEFT JOIN shape_metadata m "
    "ON m.shape_id = g.shape_id WHERE g.rowid = ?1";

SignatureRow signatureBy(const char* statement, Connection& connection, std::int64_t shapeId) {
    Query query(connection, statement, shapeId);
    if (!query.step()) raiseNoShape(shapeId);
    if (query.isNull(3)) {
        const bool failed = query.integer(1) == static_cast<int>(ShapeState::kFailed);
        raise(ErrorCode::kNotReady, "shape " + quoted(query.text(0)) +
                                        (failed ? " could not be segmented: " + query.text(2)
                                                : " has no signature yet; its job is queued"));
    }
    return readSignature(connection, query, 3, shapeId);
}

/// Throws Failure kNotFound, kNotReady.
SignatureRow servingSignature(Connection& connection, std::int64_t shapeId) {
    SignatureRow row;
    const auto look = [&](const char* statement) { row = signatureBy(statement, connection, shapeId); };
    if (!unlessDamaged([&] { look(sql::kServingSignature); })) look(kSignatureWithoutIndex);
    return row;
}

/// Appends shapes of the statement until there are `limit`.
void readIndexRows(Connection& connection, Query& query, std::size_t limit, std::vector<IndexRow>& rows) {
    for (bool more = query.step(); more && rows.size() < limit;) {
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

std::vector<IndexRow> indexRowsWithoutIndices(Connection& connection, const Collection& collection,
                                              std::int64_t afterId, std::size_t limit) {
    std::vector<std::int64_t> places;
    {
        Query query(connection, kRowsWithoutIndices, collection.id, afterId, collection.generation, limit);
        while (query.step()) places.push_back(query.integer(0));
    }
    std::vector<IndexRow> rows;
    for (const std::int64_t place : places) {
        Query query(connection, kIndexRow, place);
        readIndexRows(connection, query, rows.size() + 1, rows);
    }
    return rows;
}

}  // namespace

void SqliteStore::queueJob(Connection& connection, const PutRequest& request, std::int64_t shapeId,
                           std::int64_t pointsVersion) {
    // In the transaction of the upload, so that two cannot take the same last place.
    orRaise(requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes,
                        readTally(connection)));
    Query(connection, sql::kInsertJob, shapeId, pointsVersion, request.scan.bytes(), now()).run();
}

PutResult SqliteStore::insertShape(Connection& connection, const PutRequest& request,
                                   const PointEncoding& encoding) {
    Query(connection, sql::kInsertShape, request.collectionId, request.key, request.scan.pointCount(),
          view(request.scan.checksum()), now(), request.scan.origin().x, request.scan.origin().y,
          request.scan.origin().z)
        .run();
    const std::int64_t shapeId = connection.lastInsertId();
    SHAPEDB_FAILPOINT("insert.shape");
    writeMetadata(connection, shapeId, request.metadata.set);
    SHAPEDB_FAILPOINT("insert.metadata");
    writePoints(connection, shapeId, request, encoding);
    SHAPEDB_FAILPOINT("insert.points");
    queueJob(connection, request, shapeId, 1);
    return {PutOutcome::kCreated, *findShapeById(connection, shapeId)};
}

Shape SqliteStore::replaceMetadata(Connection& connection, const Shape& existing, const Metadata& metadata) {
    rewriteMetadata(connection, existing, metadata);
    Query(connection, sql::kRaiseVersion, existing.id, now()).run();
    return *findShapeById(connection, existing.id);
}

PutResult SqliteStore::retryShape(Connection& connection, const PutRequest& request, const Shape& existing) {
    const Metadata metadata = request.metadata.of(existing.metadata);
    if (existing.metadata != metadata) replaceMetadata(connection, existing, metadata);
    orRaise(requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes,
                        readTally(connection)));
    queueAgain(connection, existing.id, existing.pointsVersion, request.scan.bytes());
    return {PutOutcome::kRetried, *findShapeById(connection, existing.id)};
}

PutResult SqliteStore::replacePoints(Connection& connection, const PutRequest& request,
                                     const PointEncoding& encoding, const Shape& existing) {
    const std::int64_t shapeId = existing.id;
    rewriteMetadata(connection, existing, request.metadata.of(existing.metadata));
    Query(connection, sql::kReplacePointsOfShape, shapeId, request.scan.pointCount(),
          view(request.scan.checksum()), now(), request.scan.origin().x, request.scan.origin().y,
          request.scan.origin().z)
        .run();
    Query(connection, sql::kDeletePoints, shapeId).run();
    SHAPEDB_FAILPOINT("replace.deleted");
    writePoints(connection, shapeId, request, encoding);
    SHAPEDB_FAILPOINT("replace.points");
    // The serving signature stays until the new result arrives; what a running rebuild made of the
    // old points is worthless.
    const Collection collection = requireCollection(connection, existing.collectionId);
    Query(connection, sql::kDeleteOtherSignatures, shapeId, collection.generation).run();
    Query(connection, sql::kDeleteRebuildFailuresOfShape, shapeId).run();
    Query(connection, sql::kDeleteJob, shapeId).run();
    SHAPEDB_FAILPOINT("replace.unqueued");
    queueJob(connection, request, shapeId, existing.version + 1);
    return {PutOutcome::kReplaced, *findShapeById(connection, shapeId)};
}

Result<PutResult> SqliteStore::putShape(const PutRequest& request) {
    RETURN_IF_ERROR(requireSpace());
    // Compressing takes longest and needs no write lock.
    std::unique_lock<std::mutex> largeScan(largeScanMutex_, std::defer_lock);
    if (request.scan.bytes() > PointEncoding::kWholeBytes) largeScan.lock();
    const auto encoding = guarded("store the scan", [&] {
        return orRaise(PointEncoding::encode(request.scan.points(), options_.pointCompressionLevel));
    });
    RETURN_IF_ERROR(encoding);
    return write("store the scan", [&](Connection& connection) -> PutResult {
        const Collection collection = requireCollection(connection, request.collectionId);
        const std::optional<Shape> existing = findShape(connection, request.collectionId, request.key);
        switch (orRaise(decidePut(request, collection.name, existing ? &*existing : nullptr))) {
            case PutOutcome::kCreated: return insertShape(connection, request, *encoding);
            case PutOutcome::kUnchanged: return {PutOutcome::kUnchanged, *existing};
            case PutOutcome::kMetadataChanged:
                return {PutOutcome::kMetadataChanged,
                        replaceMetadata(connection, *existing, request.metadata.of(existing->metadata))};
            case PutOutcome::kRetried: return retryShape(connection, request, *existing);
            case PutOutcome::kReplaced: break;
        }
        return replacePoints(connection, request, *encoding, *existing);
    });
}

Result<Shape> SqliteStore::getShape(std::int64_t collectionId, const std::string& key) {
    return read("read the shape", [&](Connection& connection) {
        auto found = findShape(connection, collectionId, key);
        if (!found) throw Failure(noSuchShape(requireCollection(connection, collectionId).name, key));
        return std::move(*found);
    });
}

Result<Shape> SqliteStore::getShapeById(std::int64_t shapeId) {
    return read("read the shape", [&](Connection& connection) {
        auto found = findShapeById(connection, shapeId);
        if (!found) raiseNoShape(shapeId);
        return std::move(*found);
    });
}

Result<std::vector<std::optional<Shape>>> SqliteStore::getShapes(std::int64_t collectionId,
                                                                 const std::vector<std::string>& keys) {
    return read("read the shapes", [&](Connection& connection) {
        std::vector<std::optional<Shape>> found;
        found.reserve(keys.size());
        for (const std::string& key : keys) found.push_back(findShape(connection, collectionId, key));
        return found;
    });
}

Result<Shape> SqliteStore::deleteShape(std::int64_t collectionId, const std::string& key,
                                       std::optional<std::int64_t> expectedVersion) {
    return remove("delete the shape", [&](Connection& connection) {
        auto found = findShape(connection, collectionId, key);
        if (!found && expectedVersion) {
            // Done before, and the client did not hear of it.
            auto deleted = findDeletion(connection, collectionId, key, *expectedVersion);
            if (deleted) return std::move(*deleted);
        }
        if (!found) throw Failure(noSuchShape(requireCollection(connection, collectionId).name, key));
        orRaise(requireVersion(key, found->version, expectedVersion));
        if (expectedVersion) {
            Query(connection, sql::kRememberDeletion, found->id).run();
            Query(connection, sql::kForgetDeletions, connection.lastInsertId() - kDeletionsRemembered).run();
        }
        Query(connection, sql::kDeleteShape, found->id).run();
        return std::move(*found);
    });
}

Result<std::vector<Shape>> SqliteStore::deleteShapes(const std::vector<std::int64_t>& shapeIds,
                                                     const std::function<bool(const Shape&)>& still) {
    return remove("delete the shapes", [&](Connection& connection) {
        std::vector<Shape> deleted;
        for (const std::int64_t shapeId : shapeIds) {
            auto found = findShapeById(connection, shapeId);
            if (!found || !still(*found)) continue;
            Query(connection, sql::kDeleteShape, shapeId).run();
            deleted.push_back(std::move(*found));
        }
        return deleted;
    });
}

Result<std::vector<Shape>> SqliteStore::changeMetadata(
    const std::vector<std::int64_t>& shapeIds,
    const std::function<std::optional<Metadata>(const Shape&)>& change) {
    RETURN_IF_ERROR(requireSpace());
    // Once: `change` may count.
    return writeOnce("change the metadata", [&](Connection& connection) {
        std::vector<Shape> changed;
        for (const std::int64_t shapeId : shapeIds) {
            const auto found = findShapeById(connection, shapeId);
            const auto metadata = found ? change(*found) : std::nullopt;
            if (!metadata || *metadata == found->metadata) continue;
            changed.push_back(replaceMetadata(connection, *found, *metadata));
        }
        return changed;
    });
}

Result<StoredPoints> SqliteStore::loadPoints(std::int64_t shapeId) {
    return read("read the points", [&](Connection& connection) {
        Query query(connection, sql::kLoadPoints, shapeId);
        if (!query.step()) raiseNoShape(shapeId);
        return StoredPoints{readPoints(query), readPoint(query, 4)};
    });
}

Result<SignatureRow> SqliteStore::getSignature(std::int64_t shapeId) {
    return read("read the signature",
                [&](Connection& connection) { return servingSignature(connection, shapeId); });
}

Result<std::vector<std::optional<StoredHit>>> SqliteStore::getHits(const std::vector<std::int64_t>& shapeIds,
                                                                   bool withSignatures) {
    return read("read the hits", [&](Connection& connection) {
        std::vector<std::optional<StoredHit>> hits(shapeIds.size());
        for (std::size_t i = 0; i < hits.size(); ++i) {
            auto shape = findShapeById(connection, shapeIds[i]);
            if (!shape) continue;
            Result<SignatureRow> signature = fail(ErrorCode::kNotReady, "not asked for");
            if (withSignatures) {
                signature =
                    guarded("read the signature", [&] { return servingSignature(connection, shapeIds[i]); });
            }
            hits[i] = StoredHit{std::move(*shape), std::move(signature)};
        }
        return hits;
    });
}

Result<std::optional<SurfaceRow>> SqliteStore::getSurface(std::int64_t shapeId) {
    return read("read the surface points", [&](Connection& connection) {
        Query query(connection, sql::kSurfaceOfShape, shapeId);
        if (!query.step()) raiseNoShape(shapeId);
        return readSurface(query);
    });
}

Result<std::vector<IndexRow>> SqliteStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                     std::size_t limit) {
    return read("load the index", [&](Connection& connection) {
        std::vector<IndexRow> rows;
        if (limit == 0) return rows;
        const Collection collection = requireCollection(connection, collectionId);
        std::string damage;
        const bool whole = unlessDamaged(
            [&] {
                Query query(connection, sql::kLoadIndex, collectionId, afterId, collection.generation);
                rows.reserve(std::min(limit, kMostReserved));
                readIndexRows(connection, query, limit, rows);
            },
            &damage);
        if (whole) return rows;
        rows = indexRowsWithoutIndices(connection, collection, afterId, limit);
        noteDamagedIndex(damage);
        return rows;
    });
}

void SqliteStore::noteDamagedIndex(const std::string& damage) {
    const std::string line =
        "an index of the database is damaged; searches are answered from the tables alone (" + damage + ")";
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    if (std::find(findings_.begin(), findings_.end(), line) == findings_.end()) findings_.push_back(line);
}

}  // namespace shapedb::store
