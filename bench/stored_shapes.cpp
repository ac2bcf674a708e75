// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/stored_shapes.h"

#include <atomic>
#include <filesystem>
#include <optional>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "bench/bulk_fill.h"
#include "core/base/return_if_error.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "server/store/parameters_codec.h"

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

}  // namespace shapedb::bench
