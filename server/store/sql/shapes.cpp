// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes, their points and the signatures that serve.
#include <algorithm>

#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/point_blob.h"
#include "server/store/put_rules.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

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
    connection.insertPoints(
        shapeId, request.scan.bytes(),
        {encoding.size(), encoding.whole(), [&](const BlobSource::Sink& sink) { encoding.write(sink); }});
}

BlobView view(const Checksum& checksum) { return {checksum.data(), checksum.size()}; }

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
    lookUp(connection, sql::kServingSignature,
           [&](const char* sql) { row = signatureBy(sql, connection, shapeId); });
    return row;
}

}  // namespace

void SqlStore::queueJob(Connection& connection, const PutRequest& request, std::int64_t shapeId,
                        std::int64_t pointsVersion) {
    // In the transaction of the upload, so that two cannot take the same last place.
    orRaise(requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes,
                        readTally(connection)));
    Query(connection, sql::kInsertJob, shapeId, pointsVersion, request.scan.bytes(), now()).run();
}

PutResult SqlStore::insertShape(Connection& connection, const PutRequest& request,
                                const PointEncoding& encoding) {
    const std::int64_t shapeId =
        numberOf(Query(connection, sql::kInsertShape, request.collectionId, request.key,
                       request.scan.pointCount(), view(request.scan.checksum()), now(),
                       request.scan.origin().x, request.scan.origin().y, request.scan.origin().z));
    SHAPEDB_FAILPOINT("insert.shape");
    writeMetadata(connection, shapeId, request.metadata.set);
    SHAPEDB_FAILPOINT("insert.metadata");
    writePoints(connection, shapeId, request, encoding);
    SHAPEDB_FAILPOINT("insert.points");
    queueJob(connection, request, shapeId, 1);
    logChange(connection, request.collectionId, shapeId);
    return {PutOutcome::kCreated, *findShapeById(connection, shapeId)};
}

Shape SqlStore::replaceMetadata(Connection& connection, const Shape& existing, const Metadata& metadata) {
    rewriteMetadata(connection, existing, metadata);
    Query(connection, sql::kRaiseVersion, existing.id, now()).run();
    logChange(connection, existing.collectionId, existing.id);
    return *findShapeById(connection, existing.id);
}

PutResult SqlStore::retryShape(Connection& connection, const PutRequest& request, const Shape& existing) {
    const Metadata metadata = request.metadata.of(existing.metadata);
    if (existing.metadata != metadata) replaceMetadata(connection, existing, metadata);
    orRaise(requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes,
                        readTally(connection)));
    queueAgain(connection, existing.collectionId, existing.id, existing.pointsVersion, request.scan.bytes());
    return {PutOutcome::kRetried, *findShapeById(connection, existing.id)};
}

PutResult SqlStore::replacePoints(Connection& connection, const PutRequest& request,
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
    logChange(connection, existing.collectionId, shapeId);
    return {PutOutcome::kReplaced, *findShapeById(connection, shapeId)};
}

Result<PutResult> SqlStore::putShape(const PutRequest& request) {
    RETURN_IF_ERROR(requireSpace());
    // Compressing takes longest and needs no write lock.
    std::unique_lock<std::mutex> largeScan(largeScanMutex_, std::defer_lock);
    if (request.scan.bytes() > PointEncoding::kWholeBytes) largeScan.lock();
    const auto encoding = guarded("store the scan", [&] {
        return orRaise(PointEncoding::encode(request.scan.points(), pointCompressionLevel()));
    });
    RETURN_IF_ERROR(encoding);
    return write("store the scan", [&](Connection& connection) -> PutResult {
        lockCollection(connection, request.collectionId);
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

Result<Shape> SqlStore::getShape(std::int64_t collectionId, const std::string& key) {
    return read("read the shape", [&](Connection& connection) {
        auto found = findShape(connection, collectionId, key);
        if (!found) throw Failure(noSuchShape(requireCollection(connection, collectionId).name, key));
        return std::move(*found);
    });
}

Result<Shape> SqlStore::getShapeById(std::int64_t shapeId) {
    return read("read the shape", [&](Connection& connection) {
        auto found = findShapeById(connection, shapeId);
        if (!found) raiseNoShape(shapeId);
        return std::move(*found);
    });
}

Result<std::vector<std::optional<Shape>>> SqlStore::getShapes(std::int64_t collectionId,
                                                              const std::vector<std::string>& keys) {
    return read("read the shapes", [&](Connection& connection) {
        std::vector<std::optional<Shape>> found;
        found.reserve(keys.size());
        for (const std::string& key : keys) found.push_back(findShape(connection, collectionId, key));
        return found;
    });
}

Result<Shape> SqlStore::deleteShape(std::int64_t collectionId, const std::string& key,
                                    std::optional<std::int64_t> expectedVersion) {
    return remove("delete the shape", [&](Connection& connection) {
        lockCollection(connection, collectionId);
        auto found = findShape(connection, collectionId, key);
        if (!found && expectedVersion) {
            // Done before, and the client did not hear of it.
            auto deleted = findDeletion(connection, collectionId, key, *expectedVersion);
            if (deleted) return std::move(*deleted);
        }
        if (!found) throw Failure(noSuchShape(requireCollection(connection, collectionId).name, key));
        orRaise(requireVersion(key, found->version, expectedVersion));
        if (expectedVersion) {
            const std::int64_t last = numberOf(Query(connection, sql::kRememberDeletion, found->id));
            Query(connection, sql::kForgetDeletions, last - kDeletionsRemembered).run();
        }
        Query(connection, sql::kDeleteShape, found->id).run();
        logChange(connection, collectionId, found->id);
        return std::move(*found);
    });
}

Result<std::vector<Shape>> SqlStore::deleteShapes(const std::vector<std::int64_t>& shapeIds,
                                                  const std::function<bool(const Shape&)>& still) {
    return remove("delete the shapes", [&](Connection& connection) {
        lockCollectionsOf(connection, shapeIds);
        std::vector<Shape> deleted;
        for (const std::int64_t shapeId : shapeIds) {
            auto found = findShapeById(connection, shapeId);
            if (!found || !still(*found)) continue;
            Query(connection, sql::kDeleteShape, shapeId).run();
            logChange(connection, found->collectionId, shapeId);
            deleted.push_back(std::move(*found));
        }
        return deleted;
    });
}

Result<std::vector<Shape>> SqlStore::changeMetadata(
    const std::vector<std::int64_t>& shapeIds,
    const std::function<std::optional<Metadata>(const Shape&)>& change) {
    RETURN_IF_ERROR(requireSpace());
    // Once: `change` may count.
    return write(
        "change the metadata",
        [&](Connection& connection) {
            lockCollectionsOf(connection, shapeIds);
            std::vector<Shape> changed;
            for (const std::int64_t shapeId : shapeIds) {
                const auto found = findShapeById(connection, shapeId);
                const auto metadata = found ? change(*found) : std::nullopt;
                if (!metadata || *metadata == found->metadata) continue;
                changed.push_back(replaceMetadata(connection, *found, *metadata));
            }
            return changed;
        },
        Space::kTakesOnce);
}

Result<StoredPoints> SqlStore::loadPoints(std::int64_t shapeId) {
    return read("read the points", [&](Connection& connection) {
        Query query(connection, sql::kLoadPoints, shapeId);
        if (!query.step()) raiseNoShape(shapeId);
        return StoredPoints{readPoints(query), readPoint(query, 4)};
    });
}

Result<SignatureRow> SqlStore::getSignature(std::int64_t shapeId) {
    return read("read the signature",
                [&](Connection& connection) { return servingSignature(connection, shapeId); });
}

Result<std::vector<std::optional<StoredHit>>> SqlStore::getHits(const std::vector<std::int64_t>& shapeIds,
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

Result<std::optional<SurfaceRow>> SqlStore::getSurface(std::int64_t shapeId) {
    return read("read the surface points", [&](Connection& connection) {
        Query query(connection, sql::kSurfaceOfShape, shapeId);
        if (!query.step()) raiseNoShape(shapeId);
        return readSurface(query);
    });
}

Result<std::vector<IndexRow>> SqlStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                  std::size_t limit) {
    return read("load the index", [&](Connection& connection) {
        std::vector<IndexRow> rows;
        if (limit == 0) return rows;
        const Collection collection = requireCollection(connection, collectionId);
        Query query(connection, sql::kLoadIndex, collectionId, afterId, collection.generation);
        rows.reserve(std::min(limit, kMostReserved));
        readIndexRows(connection, query, rows, limit);
        return rows;
    });
}

}  // namespace shapedb::store
