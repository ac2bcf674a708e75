// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench load`: what the server adds to the work of core/, latency under load, start-up and memory of
// a large upload, each with its limit.
#include <algorithm>
#include <array>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/load_run.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/server_process.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

using nlohmann::json;

// The limits of docs/benchmarks.md.
constexpr double kLeastIngestRatio = 0.9;
constexpr double kMostP99Ratio = 3.0;
constexpr double kLeastGoodput = 0.9;
constexpr double kMostStartSeconds = 5.0;
constexpr double kMostResidentRatio = 1.3;
constexpr std::int64_t kMostUploadGrowth = 64 << 20;

constexpr std::array<const char*, 6> kParts = {"ingest",   "latency", "batches",
                                               "overload", "startup", "upload"};

struct LoadFlags {
    LoadSettings settings;
    std::vector<std::string> parts;
    std::string json;
};

/// One row of the text table.
struct Line {
    std::string what;
    std::string value;
    std::string limit;  // empty: none
    bool kept = true;
};

struct Report {
    json parts = json::object();
    std::vector<Line> lines;
};

std::string milliseconds(double seconds) { return cli::formatFixed(1e3 * seconds, 1) + " ms"; }
std::string mebibytes(std::int64_t bytes) {
    return cli::formatFixed(static_cast<double>(bytes) / (1 << 20), 1) + " MiB";
}

void report(const IngestFigures& figures, const LoadSettings& settings, Report& report) {
    json rounds = json::array();
    for (const IngestRound& round : figures.rounds)
        rounds.push_back({{"core_seconds", round.core}, {"server_seconds", round.server}});
    const bool kept = figures.ratio >= kLeastIngestRatio;
    report.parts["ingest"] = {{"scans", settings.scans},
                              {"points", settings.scanPoints},
                              {"threads", settings.threads},
                              {"rounds", rounds},
                              {"core_scans_per_second", figures.coreScansPerSecond},
                              {"server_scans_per_second", figures.serverScansPerSecond},
                              {"ratio", figures.ratio},
                              {"least_ratio", kLeastIngestRatio},
                              {"kept", kept},
                              {"core_processor_seconds_per_scan", figures.coreProcessor},
                              {"server_processor_seconds_per_scan", figures.serverProcessor},
                              {"client_processor_seconds_per_scan", figures.clientProcessor}};
    report.lines.push_back(
        {"ingest: core alone", cli::formatFixed(figures.coreScansPerSecond, 2) + " scans/s", "", true});
    report.lines.push_back({"ingest: through the server",
                            cli::formatFixed(figures.serverScansPerSecond, 2) + " scans/s", "", true});
    report.lines.push_back({"ingest: server / core", cli::formatFixed(figures.ratio, 3),
                            ">= " + cli::formatFixed(kLeastIngestRatio, 1), kept});
    report.lines.push_back({"ingest: processor time of a scan, core / server / client",
                            milliseconds(figures.coreProcessor) + " / " +
                                milliseconds(figures.serverProcessor) + " / " +
                                milliseconds(figures.clientProcessor),
                            "", true});
}

std::string both(const Latencies& latencies) {
    return milliseconds(latencies.p50) + " / " + milliseconds(latencies.p99);
}

json latencyJson(const Latencies& latencies) {
    return {{"queries", latencies.queries}, {"p50_seconds", latencies.p50}, {"p99_seconds", latencies.p99}};
}

void report(const LatencyFigures& figures, const LoadSettings& settings, Report& report) {
    const bool kept = figures.p99Ratio <= kMostP99Ratio;
    report.parts["latency"] = {{"shapes", settings.shapes},
                               {"k", settings.k},
                               {"idle", latencyJson(figures.idle)},
                               {"busy", latencyJson(figures.busy)},
                               {"p99_ratio", figures.p99Ratio},
                               {"most_p99_ratio", kMostP99Ratio},
                               {"kept", kept},
                               {"busy_scans_per_second", figures.busyScansPerSecond}};
    report.lines.push_back({"query of " + cli::formatCount(settings.shapes) + ", idle: p50 / p99",
                            both(figures.idle), "", true});
    report.lines.push_back({"query during ingest: p50 / p99", both(figures.busy), "", true});
    report.lines.push_back({"query: p99 during ingest / idle", cli::formatFixed(figures.p99Ratio, 2),
                            "<= " + cli::formatFixed(kMostP99Ratio, 1), kept});
    report.lines.push_back(
        {"ingest meanwhile", cli::formatFixed(figures.busyScansPerSecond, 2) + " scans/s", "", true});
}

void report(const BatchFigures& figures, const LoadSettings& settings, Report& report) {
    const bool kept = figures.p99Ratio <= kMostP99Ratio;
    report.parts["batches"] = {{"shapes", settings.batchShapes},
                               {"clients", settings.batchClients},
                               {"queries", settings.batchQueries},
                               {"k", settings.k},
                               {"idle", latencyJson(figures.idle)},
                               {"busy", latencyJson(figures.busy)},
                               {"p99_ratio", figures.p99Ratio},
                               {"most_p99_ratio", kMostP99Ratio},
                               {"kept", kept},
                               {"batch_searches_per_second", figures.searchesPerSecond},
                               {"peak_bytes", figures.peak}};
    report.lines.push_back({"query of " + cli::formatCount(settings.batchShapes) + ", idle: p50 / p99",
                            both(figures.idle), "", true});
    report.lines.push_back({"query beside " + std::to_string(settings.batchClients) +
                                " clients with batches of " + cli::formatCount(settings.batchQueries) +
                                ": p50 / p99",
                            both(figures.busy), "", true});
    report.lines.push_back({"query: p99 beside batches / idle", cli::formatFixed(figures.p99Ratio, 2),
                            "<= " + cli::formatFixed(kMostP99Ratio, 1), kept});
    report.lines.push_back(
        {"searches of batches meanwhile", cli::formatFixed(figures.searchesPerSecond, 0) + "/s", "", true});
    report.lines.push_back({"peak memory of the server", cli::formatBytes(figures.peak), "", true});
}

void report(const OverloadFigures& figures, const LoadSettings& settings, Report& report) {
    const bool kept = figures.ratio >= kLeastGoodput;
    report.parts["overload"] = {
        {"shapes", settings.overloadShapes},      {"clients", settings.peakClients},
        {"peak_per_second", figures.peak},        {"overloaded_per_second", figures.overloaded},
        {"refused_per_second", figures.refused},  {"ratio", figures.ratio},
        {"least_ratio", kLeastGoodput},           {"kept", kept},
        {"resident_bytes", figures.memoryBefore}, {"peak_bytes", figures.memoryPeak}};
    const std::string clients = std::to_string(settings.peakClients);
    report.lines.push_back(
        {"searches of " + cli::formatCount(settings.overloadShapes) + " by " + clients + " clients",
         cli::formatFixed(figures.peak, 0) + "/s", "", true});
    report.lines.push_back(
        {"by ten times as many: answered / refused",
         cli::formatFixed(figures.overloaded, 0) + " / " + cli::formatFixed(figures.refused, 0) + " /s", "",
         true});
    report.lines.push_back({"goodput at ten times the load / peak", cli::formatFixed(figures.ratio, 2),
                            ">= " + cli::formatFixed(kLeastGoodput, 1), kept});
    report.lines.push_back(
        {"memory of the server before / at most",
         cli::formatBytes(figures.memoryBefore) + " / " + cli::formatBytes(figures.memoryPeak), "", true});
}

void report(const StartFigures& figures, const LoadSettings&, Report& report) {
    const bool fast = figures.servingSeconds <= kMostStartSeconds;
    const bool small = figures.residentRatio <= kMostResidentRatio;
    report.parts["startup"] = {{"shapes", figures.shapes},
                               {"serving_seconds", figures.servingSeconds},
                               {"first_answer_seconds", figures.firstAnswerSeconds},
                               {"processor_seconds", figures.processorSeconds},
                               {"most_seconds", kMostStartSeconds},
                               {"resident_bytes", figures.resident},
                               {"peak_bytes", figures.peak},
                               {"cache_bytes", figures.cache},
                               {"resident_ratio", figures.residentRatio},
                               {"most_resident_ratio", kMostResidentRatio},
                               {"database_bytes", figures.databaseBytes},
                               {"kept", fast && small}};
    report.lines.push_back({"start with " + cli::formatCount(figures.shapes) + ": until it serves",
                            cli::formatSeconds(figures.servingSeconds),
                            "<= " + cli::formatSeconds(kMostStartSeconds), fast});
    report.lines.push_back({"start: processor time / until a first answer",
                            cli::formatSeconds(figures.processorSeconds) + " / " +
                                cli::formatSeconds(figures.firstAnswerSeconds),
                            "", true});
    report.lines.push_back({"start: resident / peak / cache",
                            cli::formatBytes(figures.resident) + " / " + cli::formatBytes(figures.peak) +
                                " / " + cli::formatBytes(figures.cache),
                            "", true});
    report.lines.push_back({"start: resident / cache", cli::formatFixed(figures.residentRatio, 2),
                            "<= " + cli::formatFixed(kMostResidentRatio, 1), small});
}

void report(const UploadFigures& figures, const LoadSettings&, Report& report) {
    const bool kept = figures.growth < kMostUploadGrowth;
    report.parts["upload"] = {{"point_bytes", figures.pointBytes},
                              {"seconds", figures.seconds},
                              {"growth_bytes", figures.growth},
                              {"most_growth_bytes", kMostUploadGrowth},
                              {"describe_growth_bytes", figures.describeGrowth},
                              {"peak_is_of_the_upload", figures.exact},
                              {"kept", kept}};
    report.lines.push_back(
        {"upload of " + cli::formatBytes(figures.pointBytes), cli::formatSeconds(figures.seconds), "", true});
    report.lines.push_back({"upload: memory beyond the points", mebibytes(figures.growth),
                            "< " + mebibytes(kMostUploadGrowth), kept});
    report.lines.push_back(
        {"describing it: memory beyond the points", mebibytes(figures.describeGrowth), "", true});
}

std::string table(const std::vector<Line>& lines) {
    std::string text = "| | measured | limit | |\n|---|---|---|---|\n";
    for (const Line& line : lines) {
        text += "| " + line.what + " | " + line.value + " | " + line.limit + " | " +
                (line.limit.empty() ? "" : (line.kept ? "kept" : "MISSED")) + " |\n";
    }
    return text;
}

/// Measures one part and adds its figures.
template <typename Measure>
Result<void> add(Measure measure, const LoadSettings& settings, Bench& bench, Report& all) {
    const auto progress = [&](const std::string& what, std::uint64_t done, std::uint64_t total) {
        bench.console.progress(what, done, total);
    };
    const auto figures = measure(settings, progress, bench.context());
    RETURN_IF_ERROR(figures);
    report(*figures, settings, all);
    return {};
}

Result<int> runLoad(const LoadFlags& flags, Bench& bench) {
    const LoadSettings& settings = flags.settings;
    const auto wanted = [&](const char* part) {
        return flags.parts.empty() ||
               std::find(flags.parts.begin(), flags.parts.end(), part) != flags.parts.end();
    };
    Report all;
    Result<void> done;
    if (done && wanted(kParts[0])) done = add(measureIngest, settings, bench, all);
    if (done && wanted(kParts[1])) done = add(measureLatency, settings, bench, all);
    if (done && wanted(kParts[2])) done = add(measureBatches, settings, bench, all);
    if (done && wanted(kParts[3])) done = add(measureOverload, settings, bench, all);
    if (done && wanted(kParts[4])) done = add(measureStart, settings, bench, all);
    if (done && wanted(kParts[5])) done = add(measureUpload, settings, bench, all);
    RETURN_IF_ERROR(done);
    const Environment here = environment();
    json document = {{"environment", environmentJson(here)},
                     {"command", bench.command},
                     {"seed", settings.seed},
                     {"parts", all.parts}};
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, document));
    std::string text = describe(here) + "\n" + bench.command + "\n\n" + table(all.lines);
    if (!here.optimised) text += "This program was built without optimisation: times mean nothing.\n";
    bench.console.text(text);
    return cli::kOk;
}

}  // namespace

void addLoadOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<LoadFlags>();
    LoadSettings& settings = flags->settings;
    settings.server = serverBeside();
    settings.threads = cli::defaultThreads();
    CLI::App* command = app.add_subcommand(
        "load", "A server under load: ingest beside core alone, searches during ingest, start, large upload");
    command
        ->add_option("--part", flags->parts,
                     "Only these: ingest, latency, batches, overload, startup, upload")
        ->delimiter(',')
        ->check(CLI::IsMember(std::vector<std::string>(kParts.begin(), kParts.end())))
        ->type_name("A,B,...");
    command->add_option("--server", settings.server, "The program to measure [shapedbd beside this one]")
        ->type_name("FILE");
    command->add_option("--directory", settings.directory, "Where databases are made [temporary files]")
        ->type_name("DIR");
    command->add_option("--seed", settings.seed, "Of scans and signatures")->capture_default_str();
    command->add_option("--threads", settings.threads, "Ingest workers, and threads of core's loop")
        ->check(CLI::Range(1, 256))
        ->capture_default_str();
    command->add_option("--rounds", settings.rounds, "Times each measurement is made; medians are reported")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--points", settings.scanPoints, "Points of an ingested scan")
        ->check(CLI::Range(100, 5'000'000))
        ->capture_default_str();
    command->add_option("--scans", settings.scans, "Scans of one round of ingest")
        ->check(CLI::Range(1, 100'000))
        ->capture_default_str();
    command->add_option("--shapes", settings.shapes, "latency: stored signatures")
        ->check(CLI::Range(1, 100'000'000))
        ->capture_default_str();
    command
        ->add_option("--source-points", settings.sourcePoints,
                     "Points of the scans that stored signatures are made from")
        ->check(CLI::Range(100, 1'000'000))
        ->capture_default_str();
    command->add_option("--queries", settings.queries, "latency: queries idle, and as many busy")
        ->check(CLI::Range(1, 1'000'000))
        ->capture_default_str();
    command
        ->add_option("--peak-clients", settings.peakClients,
                     "overload: as many as the server serves best; then ten times as many")
        ->check(CLI::Range(1u, 90u));
    command->add_option("--overload-shapes", settings.overloadShapes, "overload: stored signatures")
        ->check(CLI::Range(1, 100'000'000));
    command
        ->add_option("--batch-clients", settings.batchClients,
                     "batches: clients that send them without a pause")
        ->check(CLI::Range(1u, 64u));
    command->add_option("--batch-queries", settings.batchQueries, "batches: queries of each")
        ->check(CLI::Range(1, 1'000));
    command->add_option("--batch-shapes", settings.batchShapes, "batches: stored signatures")
        ->check(CLI::Range(1, 100'000'000));
    command->add_option("--query-seconds", settings.querySeconds, "latency: time for either, at most")
        ->check(CLI::Range(0.1, 36'000.0))
        ->capture_default_str();
    command->add_option("-k", settings.k, "Hits of a query")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--start-shapes", settings.startShapes, "startup: stored signatures")
        ->check(CLI::Range(1, 100'000'000))
        ->capture_default_str();
    command
        ->add_option("--start-data", settings.startData,
                     "startup: data directory to start on; made, and kept, where there is none")
        ->type_name("DIR");
    command->add_option("--upload-bytes", settings.uploadBytes, "upload: size of the scan, 12 bytes a point")
        ->check(CLI::Range(120'000, 600'000'000))
        ->capture_default_str();
    command->add_option("--json", flags->json, "All figures as JSON; '-' is standard output")
        ->type_name("FILE|-");
    command->callback([flags, &bench] {
        announceJson(bench.console, flags->json);
        bench.action = [flags, &bench] { return runLoad(*flags, bench); };
    });
}

}  // namespace shapedb::bench
