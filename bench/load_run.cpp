// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/load_run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include <sys/resource.h>

#include "bench/load_parts.h"
#include "bench/measuring.h"
#include "bench/server_process.h"
#include "bench/stored_shapes.h"
#include "bench/work_loop.h"
#include "client/api/client.h"
#include "core/base/return_if_error.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"

namespace shapedb::bench {

namespace {

/// Clients per worker: enough that no worker waits for a scan.
constexpr unsigned kClientsPerWorker = 2;
constexpr std::uint64_t kBytesPerPoint = 12;

/// Processor seconds of this process, all threads.
double processorSeconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Describes all scans without a server. Returns seconds.
Result<double> describeAll(const std::vector<PointCloud>& scans, unsigned threads,
                           const RunContext& context) {
    const ShapeParameters parameters = parametersOf(Profile::kDefault);
    const auto began = Clock::now();
    std::atomic<bool> stop{false};
    WorkLoop loop(threads, stop, [&](std::size_t i) -> Result<bool> {
        if (i >= scans.size()) return false;
        const auto description = describe(scans[i], parameters, cancelledBy(context));
        RETURN_IF_ERROR(description);
        return true;
    });
    RETURN_IF_ERROR(loop.finish());
    return since(began);
}

Result<void> addAndWait(const client::Client& client, const std::string& key, const PointCloud& scan,
                        const RunContext& context) {
    client::AddRequest request;
    request.shape.key = key;
    request.wait = true;
    const auto added = client.addShape(request, scan, context);
    RETURN_IF_ERROR(added);
    if (added->shape.state != client::ShapeState::kReady)
        return fail(ErrorCode::kInternal, "scan " + key + " could not be described");
    return {};
}

/// Sends all scans through the server. Returns seconds.
Result<double> uploadAll(const client::Client& client, const std::vector<PointCloud>& scans,
                         const std::string& prefix, unsigned threads, const RunContext& context) {
    const auto began = Clock::now();
    std::atomic<bool> stop{false};
    WorkLoop loop(kClientsPerWorker * threads, stop, [&](std::size_t i) -> Result<bool> {
        if (i >= scans.size()) return false;
        const auto added = addAndWait(client, prefix + std::to_string(i), scans[i], cancelledBy(context));
        RETURN_IF_ERROR(added);
        return true;
    });
    RETURN_IF_ERROR(loop.finish());
    return since(began);
}

double medianOf(const std::vector<IngestRound>& rounds, double (*value)(const IngestRound&)) {
    std::vector<double> values;
    for (const IngestRound& round : rounds) values.push_back(value(round));
    return median(std::move(values));
}

/// Alternates idle and busy, so that other load on the machine affects both.
Result<LatencyFigures> measureLatencyOf(const LoadSettings& settings, const client::Client& client,
                                        const client::Client& uploader,
                                        const std::vector<std::string>& queries,
                                        const std::vector<PointCloud>& scans, const LoadProgress& progress,
                                        const RunContext& context) {
    std::vector<double> idle;
    std::vector<double> busy;
    const std::size_t share = (settings.queries + settings.rounds - 1) / settings.rounds;
    const double seconds = settings.querySeconds / static_cast<double>(settings.rounds);
    double busySeconds = 0.0;
    std::uint64_t described = 0;
    const auto askInto = [&](std::vector<double>& took) {
        return ask(client, queries, settings.k, share, seconds, took, context);
    };
    std::vector<double> warmUp;
    if (const auto asked = ask(client, queries, settings.k, kWarmUpQueries, seconds, warmUp, context);
        !asked) {
        return fail(asked.error());
    }
    for (std::size_t round = 0; round < settings.rounds; ++round) {
        progress("queries", round, settings.rounds);
        RETURN_IF_ERROR(askInto(idle));
        std::atomic<bool> stop{false};
        RunContext stopped;
        stopped.cancel = &stop;
        WorkLoop loop(kClientsPerWorker * settings.threads, stop, [&](std::size_t i) -> Result<bool> {
            const std::string key = "busy-" + std::to_string(round) + "-" + std::to_string(i);
            const auto added = addAndWait(uploader, key, scans[i % scans.size()], stopped);
            RETURN_IF_ERROR(added);
            return true;
        });
        std::this_thread::sleep_for(kWarmUp);
        const auto before = client.stats();
        const auto began = Clock::now();
        RETURN_IF_ERROR(askInto(busy));
        busySeconds += since(began);
        const auto after = client.stats();
        stop = true;
        RETURN_IF_ERROR(loop.finish());
        if (!before || !after) return fail((before ? after : before).error());
        described += after->ingested - before->ingested;
        // Workers finish what was interrupted; the next round must find them idle.
        for (auto left = client.stats(); left && left->queuedJobs > 0; left = client.stats()) {
            RETURN_IF_ERROR(context.checkpoint());
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        }
    }
    LatencyFigures figures{latenciesOf(idle), latenciesOf(busy), 0.0, 0.0};
    if (figures.idle.p99 > 0.0) figures.p99Ratio = figures.busy.p99 / figures.idle.p99;
    if (busySeconds > 0.0) figures.busyScansPerSecond = static_cast<double>(described) / busySeconds;
    return figures;
}

/// `count` points on a lumpy ball, made quickly.
Result<PointCloud> makeLargeScan(std::uint64_t count, const LoadSettings& settings,
                                 const RunContext& context) {
    auto scans = makeScans(1, static_cast<std::size_t>(count), settings.seed, 1, context);
    RETURN_IF_ERROR(scans);
    return std::move(scans->front());
}

struct Start {
    double serving = 0.0;
    double answered = 0.0;
    double processor = 0.0;
    MemoryUse memory;
    client::Stats stats;
};

Result<Start> startOnce(const LoadSettings& settings, const std::string& data, const std::string& query,
                        const RunContext& context) {
    Start start;
    const auto began = Clock::now();
    const auto server = startServer(settings, data);
    RETURN_IF_ERROR(server);
    const auto client = connect(*server);
    RETURN_IF_ERROR(client);
    const auto health = client->health("", cancelledBy(context));
    RETURN_IF_ERROR(health);
    if (*health != client::Health::kServing)
        return fail(ErrorCode::kUnavailable, "the server listens but does not report that it is serving");
    start.serving = since(began);
    const auto processor = server->processorSeconds();
    RETURN_IF_ERROR(processor);
    start.processor = *processor;
    client::SearchOptions options;
    options.k = settings.k;
    const auto reply = client->searchBySignature(options, query, cancelledBy(context));
    RETURN_IF_ERROR(reply);
    start.answered = since(began);
    const auto memory = server->memory();
    RETURN_IF_ERROR(memory);
    start.memory = *memory;
    const auto stats = client->stats();
    RETURN_IF_ERROR(stats);
    start.stats = *stats;
    return start;
}

}  // namespace

Result<IngestFigures> measureIngest(const LoadSettings& settings, const LoadProgress& progress,
                                    const RunContext& context) {
    const auto directory = WorkDirectory::create(settings.directory);
    RETURN_IF_ERROR(directory);
    const auto scans =
        makeScans(settings.scans, settings.scanPoints, settings.seed, settings.threads, context);
    RETURN_IF_ERROR(scans);
    const auto server = startServer(settings, directory->path() + "/data");
    RETURN_IF_ERROR(server);
    const auto client = connect(*server);
    RETURN_IF_ERROR(client);
    RETURN_IF_ERROR(addAndWait(*client, "warm-up", scans->front(), context));

    IngestFigures figures;
    for (std::size_t round = 0; round < settings.rounds; ++round) {
        progress("ingest", round, settings.rounds);
        const double before = processorSeconds();
        const auto core = describeAll(*scans, settings.threads, context);
        RETURN_IF_ERROR(core);
        const double between = processorSeconds();
        const auto serverBefore = server->processorSeconds();
        const auto served =
            uploadAll(*client, *scans, std::to_string(round) + "-", settings.threads, context);
        RETURN_IF_ERROR(served);
        const auto serverAfter = server->processorSeconds();
        if (!serverBefore || !serverAfter) return fail((serverBefore ? serverAfter : serverBefore).error());
        figures.rounds.push_back({*core, *served});
        figures.coreProcessor += between - before;
        figures.clientProcessor += processorSeconds() - between;
        figures.serverProcessor += *serverAfter - *serverBefore;
    }
    const auto count = static_cast<double>(settings.scans);
    figures.coreScansPerSecond =
        count / medianOf(figures.rounds, [](const IngestRound& round) { return round.core; });
    figures.serverScansPerSecond =
        count / medianOf(figures.rounds, [](const IngestRound& round) { return round.server; });
    figures.ratio =
        medianOf(figures.rounds, [](const IngestRound& round) { return round.core / round.server; });
    const double all = count * static_cast<double>(settings.rounds);
    figures.coreProcessor /= all;
    figures.serverProcessor /= all;
    figures.clientProcessor /= all;
    return figures;
}

Result<LatencyFigures> measureLatency(const LoadSettings& settings, const LoadProgress& progress,
                                      const RunContext& context) {
    const auto directory = WorkDirectory::create(settings.directory);
    RETURN_IF_ERROR(directory);
    const std::string data = directory->path() + "/data";
    const auto generator = makeGenerator(settings, settings.shapes, context);
    RETURN_IF_ERROR(generator);
    RETURN_IF_ERROR(storeSignatures(data, *generator, settings.shapes, progress, context));
    const std::vector<std::string> queries = makeQueries(*generator, settings.shapes);
    const auto scans =
        makeScans(settings.scans, settings.scanPoints, settings.seed, settings.threads, context);
    RETURN_IF_ERROR(scans);
    const auto server = startServer(settings, data);
    RETURN_IF_ERROR(server);
    const auto client = connect(*server);
    RETURN_IF_ERROR(client);
    const auto uploader = connect(*server);
    RETURN_IF_ERROR(uploader);
    return measureLatencyOf(settings, *client, *uploader, queries, *scans, progress, context);
}

Result<StartFigures> measureStart(const LoadSettings& settings, const LoadProgress& progress,
                                  const RunContext& context) {
    const auto directory = WorkDirectory::create(settings.directory);
    RETURN_IF_ERROR(directory);
    const std::string data = settings.startData.empty() ? directory->path() + "/data" : settings.startData;
    const auto generator = makeGenerator(settings, settings.startShapes, context);
    RETURN_IF_ERROR(generator);
    if (!std::filesystem::exists(data)) {
        const auto filled = storeSignatures(data, *generator, settings.startShapes, progress, context);
        RETURN_IF_ERROR(filled);
    }
    const std::string query = encodeSignature(generator->make(settings.startShapes));

    StartFigures figures;
    std::vector<double> serving;
    std::vector<double> answered;
    std::vector<double> processor;
    for (std::size_t round = 0; round < settings.rounds; ++round) {
        progress("starts", round, settings.rounds);
        const auto start = startOnce(settings, data, query, context);
        RETURN_IF_ERROR(start);
        serving.push_back(start->serving);
        answered.push_back(start->answered);
        processor.push_back(start->processor);
        figures.resident = std::max(figures.resident, start->memory.resident);
        figures.peak = std::max(figures.peak, start->memory.peak);
        figures.shapes = start->stats.cachedSignatures;
        figures.cache = start->stats.cacheBytes;
        figures.databaseBytes = start->stats.databaseBytes;
    }
    figures.servingSeconds = median(serving);
    figures.firstAnswerSeconds = median(answered);
    figures.processorSeconds = median(processor);
    if (figures.cache > 0)
        figures.residentRatio = static_cast<double>(figures.resident) / static_cast<double>(figures.cache);
    return figures;
}

Result<UploadFigures> measureUpload(const LoadSettings& settings, const LoadProgress& progress,
                                    const RunContext& context) {
    const auto directory = WorkDirectory::create(settings.directory);
    RETURN_IF_ERROR(directory);
    const std::uint64_t count = settings.uploadBytes / kBytesPerPoint;
    progress("large scan", 0, 0);
    const auto scan = makeLargeScan(count, settings, context);
    RETURN_IF_ERROR(scan);
    const auto small = makeScans(1, settings.scanPoints, settings.seed + 1, 1, context);
    RETURN_IF_ERROR(small);
    const auto server =
        startServer(settings, directory->path() + "/data",
                    {"--limits-max-points", std::to_string(std::max<std::uint64_t>(count, 5'000'000))});
    RETURN_IF_ERROR(server);
    const auto client = connect(*server);
    RETURN_IF_ERROR(client);
    // Warms up the threads, connections and arenas that any upload needs.
    RETURN_IF_ERROR(addAndWait(*client, "warm-up", small->front(), cancelledBy(context)));

    UploadFigures figures;
    figures.pointBytes = count * kBytesPerPoint;
    figures.exact = server->forgetPeak();
    const auto before = server->memory();
    RETURN_IF_ERROR(before);
    client::AddRequest request;
    request.shape.key = "large";
    const auto began = Clock::now();
    const auto added = client->addShape(request, *scan, cancelledBy(context));
    RETURN_IF_ERROR(added);
    // Read at once: a worker is about to load the scan.
    const auto uploaded = server->memory();
    figures.seconds = since(began);
    RETURN_IF_ERROR(uploaded);
    const auto growthOf = [&](const MemoryUse& use) {
        return static_cast<std::int64_t>(use.peak) - static_cast<std::int64_t>(before->resident) -
               static_cast<std::int64_t>(figures.pointBytes);
    };
    figures.growth = growthOf(*uploaded);
    progress("describing the large scan", 0, 0);
    const auto settled = client->watchIngest(request.shape, {}, cancelledBy(context));
    RETURN_IF_ERROR(settled);
    const auto described = server->memory();
    RETURN_IF_ERROR(described);
    figures.describeGrowth = growthOf(*described);
    return figures;
}

}  // namespace shapedb::bench
