// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench workers`: how many scans do one, two and four workers on one PostgreSQL database take
// through the queue in a second? Each sleeps in place of segmenting, so that the database is measured and not
// the processor; or segments, on one thread. The content of the database is left alone but for a collection
// that is made and deleted.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "bench/operations.h"
#include "bench/output.h"
#include "bench/stored_shapes.h"
#include "core/base/return_if_error.h"
#include "server/ingest/signature_pipeline.h"
#include "server/store/postgres/postgres_store.h"

namespace shapedb::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kScanPoints = 500;
constexpr const char* kCollectionName = "bench-workers";

struct WorkersFlags {
    std::string database;
    std::vector<int> workers = {1, 2, 4};
    int scans = 400;
    int sleepMs = 50;
    int points = 0;  ///< of scans that are segmented; 0: sleep
    int rounds = 3;
};

Result<std::unique_ptr<store::Store>> openAs(const std::string& name, const WorkersFlags& flags) {
    store::PostgresOptions options;
    options.uri = flags.database;
    options.serverName = "bench-" + name;
    options.lockPath = "/tmp/shapedb-bench-" + std::to_string(::getpid()) + "-" + name;
    options.temporaryFolder = "/tmp";
    options.connections = 2;
    return store::openPostgresStore(options);
}

/// Points that are never segmented.
std::vector<float> anyPoints(std::size_t scan) {
    std::vector<float> points(3 * kScanPoints);
    for (std::size_t k = 0; k < points.size(); ++k) {
        points[k] = static_cast<float>((k * 7919 + scan * 31) % 1000);
    }
    return points;
}

/// Those of all scans.
Result<std::vector<std::vector<float>>> pointsOf(const WorkersFlags& flags, const RunContext& context) {
    const auto count = static_cast<std::size_t>(flags.scans);
    std::vector<std::vector<float>> all;
    if (flags.points == 0) {
        for (std::size_t i = 0; i < count; ++i) all.push_back(anyPoints(i));
        return all;
    }
    const auto scans = makeScans(count, static_cast<std::size_t>(flags.points), 1,
                                 std::thread::hardware_concurrency(), context);
    RETURN_IF_ERROR(scans);
    for (const PointCloud& scan : *scans) all.push_back(packedPoints(scan));
    return all;
}

Result<void> fillQueue(store::Store& store, std::int64_t collection,
                       const std::vector<std::vector<float>>& scans) {
    for (std::size_t i = 0; i < scans.size(); ++i) {
        auto scan = store::VerifiedScan::verify(scans[i]);
        RETURN_IF_ERROR(scan);
        store::PutRequest put(std::move(*scan));
        put.collectionId = collection;
        put.key = std::to_string(i);
        RETURN_IF_ERROR(store.putShape(put));
    }
    return {};
}

/// What a worker makes of a job: of its scan, or after a while of nothing.
Result<store::SignatureRow> resultOf(store::Store& store, const store::Job& job, const WorkersFlags& flags) {
    if (flags.points == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(flags.sleepMs));
        return store::SignatureRow{job.shapeId, job.pointsVersion, job.generation, std::string(800, 's')};
    }
    const ingest::SignaturePipeline pipeline(
        [](const PointCloud& points, const ShapeParameters& parameters, const RunContext& context) {
            return shapedb::describe(points, parameters, context);
        });
    auto made = pipeline.run(store, job.shapeId, parametersOf(Profile::kDefault), {});
    if (made.kind != ingest::PipelineOutcome::Kind::kSignature) return fail(made.why);
    return rowOf(std::move(made), job.shapeId, job.pointsVersion, job.generation);
}

/// Claims, sleeps or segments, and finishes until the queue is empty. Returns how many results counted.
Result<int> work(store::Store& store, const WorkersFlags& flags) {
    for (int finished = 0;;) {
        const auto job = store.claimJob();
        RETURN_IF_ERROR(job);
        if (!*job) return finished;
        const auto row = resultOf(store, **job, flags);
        RETURN_IF_ERROR(row);
        const auto done = store.finishJob(**job, *row);
        RETURN_IF_ERROR(done);
        if (*done) ++finished;
    }
}

/// Scans a second of so many workers, each a server of its own. Errors: kInternal (a scan was lost, or
/// counted twice).
Result<double> measure(store::Store& store, int workers, const std::vector<std::vector<float>>& scans,
                       const WorkersFlags& flags) {
    const auto collection = store.createCollection(kCollectionName, "", "{}");
    RETURN_IF_ERROR(collection);
    RETURN_IF_ERROR(fillQueue(store, collection->id, scans));
    std::vector<std::unique_ptr<store::Store>> servers;
    for (int i = 0; i < workers; ++i) {
        auto opened = openAs(std::to_string(i), flags);
        RETURN_IF_ERROR(opened);
        servers.push_back(std::move(*opened));
    }
    std::atomic<int> finished{0};
    std::vector<Result<int>> outcomes(servers.size(), Result<int>(0));
    const auto began = Clock::now();
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < servers.size(); ++i) {
        threads.emplace_back([&, i] {
            outcomes[i] = work(*servers[i], flags);
            if (outcomes[i]) finished += *outcomes[i];
        });
    }
    for (std::thread& thread : threads) thread.join();
    const std::chrono::duration<double> taken = Clock::now() - began;
    for (const auto& outcome : outcomes) RETURN_IF_ERROR(outcome);
    store::ShapeFilter ready;
    ready.state = store::ShapeState::kReady;
    const auto stored = store.countShapes(collection->id, ready);
    RETURN_IF_ERROR(stored);
    RETURN_IF_ERROR(store.deleteCollection(collection->id));
    if (finished != flags.scans || *stored != static_cast<std::uint64_t>(flags.scans)) {
        return fail(ErrorCode::kInternal, std::to_string(flags.scans) + " scans, " +
                                              std::to_string(finished) + " results counted, " +
                                              std::to_string(*stored) + " shapes are ready");
    }
    return flags.scans / taken.count();
}

Result<int> runWorkers(const WorkersFlags& flags, Bench& bench) {
    const auto store = openAs("main", flags);
    RETURN_IF_ERROR(store);
    const auto scans = pointsOf(flags, bench.context());
    RETURN_IF_ERROR(scans);
    bench.console.text(
        describe(environment()) + "\n" + bench.command + "\n" + std::to_string(flags.scans) + " scans, " +
        (flags.points > 0 ? "segmented, of " + std::to_string(flags.points) + " points"
                          : std::to_string(flags.sleepMs) + " ms each") +
        ", best of " + std::to_string(flags.rounds) + " rounds\n\nworkers  scans/s  beside one\n");
    double alone = 0.0;
    for (const int workers : flags.workers) {
        double best = 0.0;
        for (int round = 0; round < flags.rounds; ++round) {
            RETURN_IF_ERROR(bench.context().checkpoint());
            const auto rate = measure(**store, workers, *scans, flags);
            RETURN_IF_ERROR(rate);
            best = std::max(best, *rate);
        }
        if (alone == 0.0) alone = best / workers;
        bench.console.text(numberText("%7.0f", workers) + numberText("  %7.1f", best) +
                           numberText("  %10.2f\n", best / alone));
    }
    return cli::kOk;
}

}  // namespace

void addWorkersOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<WorkersFlags>();
    CLI::App* command = app.add_subcommand(
        "workers", "How many times one worker's scans do several take, on one PostgreSQL database?");
    command->add_option("--database", flags->database, "URI of a database that nothing else uses")
        ->required();
    command->add_option("--workers", flags->workers, "How many at a time")->delimiter(',')->type_name("N,N");
    command->add_option("--scans", flags->scans, "In the queue")->check(CLI::Range(1, 1'000'000));
    command->add_option("--sleep-ms", flags->sleepMs, "In place of segmenting")->check(CLI::Range(0, 60'000));
    command->add_option("--points", flags->points, "Segment scans of so many points instead; 0: sleep")
        ->check(CLI::Range(0, 1'000'000));
    command->add_option("--rounds", flags->rounds, "The best counts")->check(CLI::Range(1, 100));
    command->callback(
        [&bench, flags] { bench.action = [&bench, flags] { return runWorkers(*flags, bench); }; });
}

}  // namespace shapedb::bench
