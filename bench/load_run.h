// The work of `shapedb-bench load`: a server of its own under load, measured from outside.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::bench {

struct LoadSettings {
    std::string server;     ///< the program, shapedbd
    std::string directory;  ///< where databases are made; empty: where temporary files go
    std::uint64_t seed = 1;
    unsigned threads = 2;  ///< ingest workers of the server, and threads of the loop beside it
    std::size_t rounds = 3;
    std::size_t scanPoints = 20'000;
    std::size_t scans = 24;            ///< ingest: of one round
    std::uint64_t shapes = 100'000;    ///< latency: stored
    std::size_t sourcePoints = 3'000;  ///< of the scans that stored signatures are drawn around
    std::size_t sourceMembers = 8;     ///< of each family among them
    std::size_t queries = 300;         ///< latency: at most, idle and busy each
    double querySeconds = 120.0;       ///< latency: for these, idle and busy each, about
    std::uint32_t k = 10;
    std::uint64_t startShapes = 1'000'000;
    std::string startData;  ///< startup: data directory to use; made, and kept, where there is none
    std::uint64_t uploadBytes = 100'000'000;  ///< 12 a point
};

/// Seconds of one round, N scans each way.
struct IngestRound {
    double core = 0.0;
    double server = 0.0;
};

struct IngestFigures {
    std::vector<IngestRound> rounds;
    double coreScansPerSecond = 0.0;    ///< median of the rounds
    double serverScansPerSecond = 0.0;  ///< median of the rounds
    double ratio = 0.0;                 ///< median of the rounds: throughput of the server over core's
    /// Processor seconds a scan, all rounds: they do not stretch when others use the machine.
    double coreProcessor = 0.0;
    double serverProcessor = 0.0;
    double clientProcessor = 0.0;
};

struct Latencies {
    std::size_t queries = 0;
    double p50 = 0.0;  ///< seconds, as the client sees them
    double p99 = 0.0;
};

struct LatencyFigures {
    Latencies idle;
    Latencies busy;  ///< while every ingest worker always has a scan
    double p99Ratio = 0.0;
    double busyScansPerSecond = 0.0;  ///< described meanwhile
};

struct StartFigures {
    std::uint64_t shapes = 0;         ///< with a signature
    double servingSeconds = 0.0;      ///< from exec until health says SERVING; median of the rounds
    double firstAnswerSeconds = 0.0;  ///< from exec until a first search was answered; the same
    double processorSeconds = 0.0;    ///< until it served, all threads; median of the rounds
    std::uint64_t resident = 0;       ///< bytes after that answer; largest of the rounds
    std::uint64_t peak = 0;
    std::uint64_t cache = 0;     ///< bytes the server says its cache holds
    double residentRatio = 0.0;  ///< resident over cache
    std::uint64_t databaseBytes = 0;
};

struct UploadFigures {
    std::uint64_t pointBytes = 0;     ///< as sent
    double seconds = 0.0;             ///< until the server confirmed
    std::int64_t growth = 0;          ///< peak of the upload over resident before, less the points
    std::int64_t describeGrowth = 0;  ///< the same until the scan was described
    bool exact = true;                ///< false: the peak is that since the start
};

/// Told what is being done: stage, done, total.
using LoadProgress = std::function<void(const std::string& what, std::uint64_t done, std::uint64_t total)>;

/// Each starts servers of its own. Errors: those of the server, the client and the method; kCancelled.
[[nodiscard]] Result<IngestFigures> measureIngest(const LoadSettings& settings, const LoadProgress& progress,
                                                  const RunContext& context);
[[nodiscard]] Result<LatencyFigures> measureLatency(const LoadSettings& settings,
                                                    const LoadProgress& progress, const RunContext& context);
[[nodiscard]] Result<StartFigures> measureStart(const LoadSettings& settings, const LoadProgress& progress,
                                                const RunContext& context);
[[nodiscard]] Result<UploadFigures> measureUpload(const LoadSettings& settings, const LoadProgress& progress,
                                                  const RunContext& context);

}  // namespace shapedb::bench
