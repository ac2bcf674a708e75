// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sql/collection_copy.h"

#include "server/store/point_blob.h"
#include "server/store/sql/rows.h"

namespace shapedb::store {

namespace {

/// What one transaction copies: a few milliseconds of the write lock, and of memory.
constexpr std::size_t kShapesAtATime = 64;
constexpr std::size_t kBytesAtATime = std::size_t{4} << 20;
/// What one transaction deletes. Of a shape up to a dozen pages are written to the log, of its points one in
/// a thousand of their pages: in all less than SpaceReserve::kBytes.
constexpr std::size_t kShapesPerDeletion = 256;
constexpr std::size_t kBytesPerDeletion = std::size_t{64} << 20;

std::size_t bytesOf(const CopiedShape& copied) {
    return copied.points.size() +
           (copied.signature ? copied.signature->bytes.size() + copied.signature->views.size() : 0) +
           (copied.surface ? copied.surface->bytes.size() : 0);
}

CopiedShape withContent(Connection& source, Shape shape, std::int64_t generation) {
    CopiedShape copied;
    copied.shape = std::move(shape);
    const std::int64_t id = copied.shape.id;
    {
        Query points(source, sql::kStoredPoints, id);
        if (!points.step()) {
            raise(ErrorCode::kDataLoss, "the points of shape " + quoted(copied.shape.key) + " are missing");
        }
        copied.pointBytes = static_cast<std::uint64_t>(points.integer(0));
        copied.points = bytesOf(points.blob(2));
    }
    {
        Query signature(source, sql::kServingSignature, id);
        if (signature.step() && !signature.isNull(3)) {
            copied.signature = readSignature(source, signature, 3, id);
            copied.signature->generation = generation;
        }
    }
    Query surface(source, sql::kSurfaceOfShape, id);
    if (surface.step()) copied.surface = readSurface(surface);
    return copied;
}

}  // namespace

// Large ones in pieces, for which a database may have a better way.
BlobSource sourceOf(const std::string& bytes) {
    if (bytes.size() <= PointEncoding::kWholeBytes) return {bytes.size(), &bytes};
    return {bytes.size(), nullptr,
            [&bytes](const BlobSource::Sink& sink) { sink(bytes.data(), bytes.size()); }};
}

std::uint64_t countShapesOf(Connection& connection, std::int64_t collectionId) {
    return static_cast<std::uint64_t>(numberOf(Query(connection, sql::kCountShapes, collectionId)));
}

std::vector<CopiedShape> nextShapes(Connection& source, const Collection& collection, std::int64_t afterId) {
    std::vector<CopiedShape> batch;
    std::size_t bytes = 0;
    Query query(source, sql::kListShapes, collection.id, afterId);
    forEachShape(query, [&](Shape shape) {
        batch.push_back(withContent(source, std::move(shape), collection.generation));
        bytes += bytesOf(batch.back());
        return batch.size() < kShapesAtATime && bytes < kBytesAtATime;
    });
    return batch;
}

std::int64_t insertCollection(Connection& target, const Collection& collection, const std::string& name) {
    return numberOf(Query(target, sql::kCopyCollection, name, collection.description, collection.parameters,
                          collection.generation, collection.createdAt));
}

void insertCopy(Connection& target, std::int64_t collectionId, const CopiedShape& copied) {
    const Shape& shape = copied.shape;
    const Error failure = shape.failure.value_or(Error{});
    const std::int64_t shapeId =
        numberOf(Query(target, sql::kCopyShape, collectionId, shape.key, shape.version, shape.pointsVersion,
                       static_cast<int>(shape.state), shape.pointCount,
                       BlobView{shape.checksum.data(), shape.checksum.size()}, shape.createdAt,
                       shape.updatedAt, std::string(errorCodeName(failure.code)), failure.message,
                       shape.origin.x, shape.origin.y, shape.origin.z));
    for (const auto& [name, value] : shape.metadata) {
        Query(target, sql::kInsertMetadata, shapeId, name, value).run();
    }
    target.insertPoints(shapeId, copied.pointBytes, sourceOf(copied.points));
    if (copied.signature) {
        SignatureRow row = *copied.signature;
        row.shapeId = shapeId;
        putSignature(target, row);
    }
    if (copied.surface) {
        const SurfaceRow& surface = *copied.surface;
        Query(target, sql::kPutSurface, shapeId, surface.pointsVersion, digestOf(surface.bytes),
              viewOf(surface.bytes))
            .run();
    }
}

void queuePending(Connection& connection, std::int64_t collectionId, TimestampMs now) {
    Query(connection, sql::kQueuePending, collectionId, now).run();
}

void copyCollection(Connection& source, const Collection& collection, Connection& target, TimestampMs now,
                    const RunContext& context) {
    const std::uint64_t total = countShapesOf(source, collection.id);
    std::uint64_t done = 0;
    std::int64_t copyId = 0;
    {
        Transaction transaction(target, Transaction::Kind::kWrite);
        copyId = insertCollection(target, collection, collection.name);
        transaction.commit();
    }
    for (std::int64_t afterId = 0;;) {
        orRaise(context.checkpoint());
        context.report("export", done, total);
        const std::vector<CopiedShape> batch = nextShapes(source, collection, afterId);
        Transaction transaction(target, Transaction::Kind::kWrite);
        for (const CopiedShape& copied : batch) insertCopy(target, copyId, copied);
        if (batch.empty()) queuePending(target, copyId, now);
        transaction.commit();
        if (batch.empty()) return;
        afterId = batch.back().shape.id;
        done += batch.size();
    }
}

bool deleteSome(Connection& connection, std::int64_t collectionId) {
    std::vector<std::int64_t> ids;
    bool all = true;
    {
        std::size_t bytes = 0;
        Query query(connection, sql::kStoredSizes, collectionId);
        while (all && query.step()) {
            bytes += static_cast<std::size_t>(query.integer(1));
            all = ids.empty() || (ids.size() < kShapesPerDeletion && bytes <= kBytesPerDeletion);
            if (all) ids.push_back(query.integer(0));
        }
    }
    for (const std::int64_t id : ids) Query(connection, sql::kDeleteShape, id).run();
    if (all) Query(connection, sql::kDeleteCollection, collectionId).run();
    return all;
}

}  // namespace shapedb::store
