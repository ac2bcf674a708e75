// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/stored_shapes.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <optional>
#include <vector>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "server/store/parameters_codec.h"
#include "server/store/point_blob.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql.h"
#include "server/store/sqlite/connection.h"

namespace shapedb::bench {

namespace {

constexpr double kScanNoise = 0.005;  // of the diagonal

/// Runs `work(i)` for all i < count on that many threads; the first error ends it.
template <typename Work>
Result<void> forEach(std::size_t count, unsigned threads, const RunContext& context, Work&& work) {
    std::vector<std::optional<Error>> errors(count);
    std::atomic<bool> stop{false};
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute([&] {
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
            if (stop) return;
            Result<void> done = context.checkpoint();
            if (done) done = work(i);
            if (done) return;
            errors[i] = done.error();
            stop = true;
        });
    });
    for (const auto& error : errors) {
        if (error) return fail(*error);
    }
    return {};
}

Result<PointCloud> makeScan(std::size_t index, std::size_t points, std::uint64_t seed) {
    const auto families = listFamilies();
    const auto solid = makeMember(families[index % families.size()].name, index / families.size(), seed);
    RETURN_IF_ERROR(solid);
    ScanOptions options;
    options.count = points;
    options.noise = kScanNoise;
    options.seed = seed + index;
    return scanOf(*solid, options);
}

}  // namespace

Result<std::vector<PointCloud>> makeScans(std::size_t count, std::size_t points, std::uint64_t seed,
                                          unsigned threads, const RunContext& context) {
    std::vector<PointCloud> scans(count);
    const auto made = forEach(count, threads, context, [&](std::size_t i) -> Result<void> {
        auto scan = makeScan(i, points, seed);
        RETURN_IF_ERROR(scan);
        scans[i] = std::move(*scan);
        return {};
    });
    RETURN_IF_ERROR(made);
    return scans;
}

std::vector<float> packedPoints(const PointCloud& scan) {
    std::vector<float> points;
    for (const Point3& p : scan) {
        for (const double v : {p.x, p.y, p.z}) points.push_back(static_cast<float>(v));
    }
    return points;
}

Result<void> fillDataDirectory(const std::string& data, const SignatureGenerator& generator,
                               std::uint64_t count, const RunContext& context) {
    std::error_code error;
    std::filesystem::create_directories(data, error);
    store::SqliteOptions options;
    options.path = data + "/shapedb.sqlite";
    return fillDatabase(
        options, "default", store::encodeParameters(parametersOf(Profile::kDefault)), count,
        [&](std::uint64_t i) {
            return FillShape{"shape-" + std::to_string(i),
                             {{"label", "class-" + std::to_string(generator.classOf(i))}},
                             encodeSignature(generator.make(i))};
        },
        context);
}

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
    const std::int64_t id =
        numberOf(Query(connection, sql::kInsertShape, collectionId, shape.key, scan.points.size() / 3,
                       BlobView{scan.checksum.data(), scan.checksum.size()}, now, 0.0, 0.0, 0.0));
    for (const auto& [name, value] : shape.metadata)
        Query(connection, sql::kInsertMetadata, id, name, value).run();
    connection.insertPoints(id, scan.points.size() * sizeof(float), {scan.blob.size(), &scan.blob});
    Query(connection, sql::kPutSignature, id, kFirstGeneration, 1, digestOf(shape.signature),
          viewOf(shape.signature), BlobOrNull{})
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
