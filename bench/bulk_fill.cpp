// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/bulk_fill.h"

#include <algorithm>
#include <vector>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "server/store/point_blob.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql.h"

namespace shapedb::bench {

using namespace store;

namespace {

constexpr std::uint64_t kShapesPerCommit = 10'000;
constexpr std::int64_t kFirstGeneration = 1;
constexpr int kBusyTimeoutMs = 5'000;

/// The same for every shape.
struct Scan {
    std::vector<float> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::string blob = orRaise(encodePoints(points, 1));
    Checksum checksum = sha256(points.data(), points.size() * sizeof(float));
};

void insertReady(SqliteConnection& connection, std::int64_t collectionId, const FillShape& shape,
                 const Scan& scan, TimestampMs now) {
    Query(connection, sql::kInsertShape, collectionId, shape.key, scan.points.size() / 3,
          BlobView{scan.checksum.data(), scan.checksum.size()}, now, 0.0, 0.0, 0.0)
        .run();
    const std::int64_t id = connection.lastInsertId();
    for (const auto& [name, value] : shape.metadata)
        Query(connection, sql::kInsertMetadata, id, name, value).run();
    Query(connection, sql::kInsertPoints, id, scan.points.size() * sizeof(float), scan.blob.size(),
          BlobView{scan.blob.data(), scan.blob.size()})
        .run();
    Query(connection, sql::kPutSignature, id, kFirstGeneration, 1, digestOf(shape.signature),
          BlobView{shape.signature.data(), shape.signature.size()})
        .run();
    Query(connection, sql::kSetReady, id, now).run();
}

}  // namespace

Result<void> fillDatabase(const SqliteOptions& options, const std::string& collection,
                          const std::string& parameters, std::uint64_t count,
                          const std::function<FillShape(std::uint64_t)>& make, const RunContext& context) {
    // The store holds the lock and has brought the schema up to date; it is not used meanwhile.
    const auto store = openSqliteStore(options);
    RETURN_IF_ERROR(store);
    const auto created = (*store)->createCollection(collection, "", parameters);
    RETURN_IF_ERROR(created);
    const auto filled = guarded("fill the database", [&] {
        SqliteConnection connection(options.path, OpenMode::kReadWrite, kBusyTimeoutMs);
        const Scan scan;
        for (std::uint64_t i = 0; i < count;) {
            if (const auto go = context.checkpoint(); !go) raise(go.error().code, go.error().message);
            context.report("fill", i, count);
            Transaction transaction(connection, Transaction::Kind::kWrite);
            const std::uint64_t end = std::min(count, i + kShapesPerCommit);
            for (; i < end; ++i) insertReady(connection, created->id, make(i), scan, created->createdAt);
            transaction.commit();
        }
    });
    RETURN_IF_ERROR(filled);
    return (*store)->checkpoint();
}

}  // namespace shapedb::bench
