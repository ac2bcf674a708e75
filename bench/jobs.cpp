// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/jobs.h"

#include <cstring>
#include <fstream>
#include <memory>

#include <tbb/global_control.h>

#include "bench/output.h"
#include "bench/stored_shapes.h"
#include "client/io/ply_writer.h"
#include "client/io/scan_reader.h"
#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/search/top_k.h"
#include "core/signature/signature_codec.h"
#include "server/store/sqlite/sqlite_store.h"

// Not inlined, cloned or mangled: callgrind finds it by name.
#ifdef __clang__
#define SHAPEDB_AS_IT_IS __attribute__((noinline))
#else
#define SHAPEDB_AS_IT_IS __attribute__((noipa))
#endif

extern "C" SHAPEDB_AS_IT_IS void shapedb_bench_counted(const std::function<void()>* work) { (*work)(); }

namespace shapedb::bench {

namespace {

using Work = std::function<Result<void>()>;

constexpr std::uint64_t kJobSeed = 1;
constexpr std::size_t kSignatures = 2'000;
constexpr std::size_t kSegmentPoints = 5'000;
constexpr std::size_t kSignaturePoints = 2'000;
constexpr std::size_t kPlyPoints = 100'000;
constexpr std::size_t kStoredShapes = 200;
constexpr std::size_t kStoredPoints = 500;
constexpr std::size_t kJobHits = 10;
/// Neighbours are of different families: few pairs are of the same kind, as in a search.
constexpr std::size_t kPairStep = 7;

Result<PointCloud> oneScan(std::size_t points) {
    auto scans = makeScans(2, points, kJobSeed, 1, {});
    RETURN_IF_ERROR(scans);
    return std::move(scans->back());
}

Result<Work> segmentJob(const JobFolder&) {
    auto scan = oneScan(kSegmentPoints);
    RETURN_IF_ERROR(scan);
    return Work([scan = std::move(*scan)]() -> Result<void> {
        const auto segmentation = segment(scan, parametersOf(Profile::kDefault).segmentation);
        RETURN_IF_ERROR(segmentation);
        return {};
    });
}

Result<Work> signatureJob(const JobFolder&) {
    const auto scan = oneScan(kSignaturePoints);
    RETURN_IF_ERROR(scan);
    auto made = segment(*scan, parametersOf(Profile::kDefault).segmentation);
    RETURN_IF_ERROR(made);
    const auto segmentation = std::make_shared<const Segmentation>(std::move(*made));
    return Work([segmentation]() -> Result<void> {
        const auto signature = makeSignature(*segmentation, parametersOf(Profile::kDefault).signature);
        RETURN_IF_ERROR(signature);
        return {};
    });
}

/// The file alternates lengths (4 bytes, little-endian) and signatures.
Result<std::vector<Signature>> readSignatures(const JobFolder& folder) {
    std::ifstream file(folder.signatures(), std::ios::binary);
    std::vector<Signature> all;
    std::uint32_t size = 0;
    while (file.read(reinterpret_cast<char*>(&size), sizeof size)) {
        std::string bytes(size, '\0');
        file.read(bytes.data(), size);
        auto signature = decodeSignature(bytes);
        RETURN_IF_ERROR(signature);
        all.push_back(std::move(*signature));
    }
    if (all.size() != kSignatures)
        return fail(ErrorCode::kFileNotReadable, folder.signatures() + " is missing or of another version");
    return all;
}

Result<Work> scoreJob(const JobFolder& folder) {
    auto signatures = readSignatures(folder);
    RETURN_IF_ERROR(signatures);
    return Work([all = std::move(*signatures)]() -> Result<void> {
        double sum = 0.0;
        for (std::size_t i = 0; i < all.size(); ++i)
            sum += score(all[i], all[(i + kPairStep) % all.size()], {});
        // Also keeps the compiler from removing the loop.
        if (!(sum > 0.0)) return fail(ErrorCode::kInternal, "no pair has a score");
        return {};
    });
}

Result<Work> topKJob(const JobFolder& folder) {
    auto signatures = readSignatures(folder);
    RETURN_IF_ERROR(signatures);
    const Signature query = signatures->back();
    signatures->pop_back();
    std::vector<IndexEntry> entries;
    for (Signature& signature : *signatures) {
        entries.push_back({static_cast<std::int64_t>(entries.size()) + 1, {}, std::move(signature)});
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    return Work([set, query]() -> Result<void> {
        SearchOptions options;
        options.k = kJobHits;
        const auto found = topK(query, set, options);
        RETURN_IF_ERROR(found);
        return {};
    });
}

/// One shape through the store.
Result<void> storeOne(store::Store& store, std::int64_t collection, const std::string& key,
                      const std::vector<float>& points, const std::string& signature) {
    auto scan = store::VerifiedScan::verify(points);
    RETURN_IF_ERROR(scan);
    store::PutRequest put(std::move(*scan));
    put.collectionId = collection;
    put.key = key;
    put.metadata.set = {{"family", "mug"}};
    const auto stored = store.putShape(put);
    RETURN_IF_ERROR(stored);
    const auto job = store.claimJob();
    RETURN_IF_ERROR(job);
    if (!*job) return fail(ErrorCode::kInternal, "a stored shape has no job");
    const auto loaded = store.loadPoints((*job)->shapeId);
    RETURN_IF_ERROR(loaded);
    const auto done =
        store.finishJob(**job, {(*job)->shapeId, (*job)->pointsVersion, (*job)->generation, signature});
    RETURN_IF_ERROR(done);
    return {};
}

Result<Work> storeJob(const JobFolder& folder) {
    const auto scan = oneScan(kStoredPoints);
    RETURN_IF_ERROR(scan);
    const std::vector<float> points = packedPoints(*scan);
    store::SqliteOptions options;
    options.path = folder.path + "/job.sqlite";
    options.now = [] { return store::TimestampMs{1'700'000'000'000}; };  // the same row every time
    auto opened = store::openSqliteStore(options);
    RETURN_IF_ERROR(opened);
    const std::shared_ptr<store::Store> store = std::move(*opened);
    const auto collection = store->createCollection("default", "", "");
    RETURN_IF_ERROR(collection);
    return Work([store, points, id = collection->id]() -> Result<void> {
        const std::string signature(1'000, 's');
        for (std::size_t i = 0; i < kStoredShapes; ++i) {
            const auto stored = storeOne(*store, id, "shape-" + std::to_string(i), points, signature);
            RETURN_IF_ERROR(stored);
        }
        const auto rows = store->loadIndex(id, 0, kStoredShapes);
        RETURN_IF_ERROR(rows);
        return {};
    });
}

Result<Work> plyJob(const JobFolder& folder) {
    const auto scan = oneScan(kPlyPoints);
    RETURN_IF_ERROR(scan);
    const std::string path = folder.path + "/job.ply";
    RETURN_IF_ERROR(writePointsPly(path, *scan));
    return Work([path]() -> Result<void> {
        const auto read = readScan(path);
        RETURN_IF_ERROR(read);
        return {};
    });
}

}  // namespace

const std::vector<Job>& jobs() {
    static const std::vector<Job> all = {
        {"segment-5000", "segments of a scan of 5,000 points, default profile", segmentJob},
        {"signature-2000", "signature of the segments of 2,000 points", signatureJob},
        {"score-2000", "scores of 2,000 pairs of signatures", scoreJob},
        {"top10-2000", "the ten best of 2,000 signatures", topKJob},
        {"store-200", "200 scans of 500 points and their signatures into the database and out of it",
         storeJob},
        {"ply-100000", "a binary PLY file of 100,000 points", plyJob},
    };
    return all;
}

Result<void> prepareJobs(const JobFolder& folder, unsigned threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto generator = SignatureGenerator::create({Mixture::kPlain, kSignatures, kJobSeed, 3000, 2}, {});
    RETURN_IF_ERROR(generator);
    std::string bytes;
    for (std::size_t i = 0; i < kSignatures; ++i) {
        const std::string signature = encodeSignature(generator->make(i));
        const auto size = static_cast<std::uint32_t>(signature.size());
        bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
        bytes += signature;
    }
    return writeText(folder.signatures(), bytes);
}

Result<void> runCounted(const Work& work) {
    // callgrind counts only the thread that enters the function.
    const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
    Result<void> result;
    const std::function<void()> counted = [&] { result = work(); };
    shapedb_bench_counted(&counted);
    return result;
}

}  // namespace shapedb::bench
