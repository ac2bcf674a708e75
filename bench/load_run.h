// SPDX-License-Identifier: GPL-3.0-or-later
// The work of `shapedb-bench load`: starts a server and measures it under load from outside.
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
    std::string directory;  ///< for databases; empty: the folder for temporary files
    std::uint64_t seed = 1;
    unsigned threads = 2;  ///< ingest workers of the server, and threads of the loop beside it
    std::size_t rounds = 3;
    std::size_t scanPoints = 20'000;
    std::size_t scans = 24;            ///< ingest: of one round
    std::uint64_t shapes = 100'000;    ///< latency: stored
    std::size_t sourcePoints = 3'000;  ///< of the scans that stored signatures are drawn around
    std::size_t sourceMembers = 8;     ///< of each family among them
    std::size_t queries = 300;         ///< latency: at most, idle and busy each
    double querySeconds = 120.0;       ///< latency: or about this long, idle and busy each
    std::uint32_t k = 10;
    unsigned batchClients = 4;          ///< batches: clients that send SearchBatch without a pause
    std::size_t batchQueries = 1'000;   ///< batches: of each
    std::uint64_t batchShapes = 1'000;  ///< batches: stored
    unsigned peakClients = 25;  ///< overload: as many as the server serves best; ten times as many after
    std::uint64_t overloadShapes = 10'000;  ///< overload: stored
    std::uint64_t startShapes = 1'000'000;
    std::string startData;                    ///< startup: data directory; filled first if missing, and kept
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
    /// Processor seconds per scan over all rounds, which other load on the machine affects little.
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
    Latencies busy;  ///< while all ingest workers are busy
    double p99Ratio = 0.0;
    double busyScansPerSecond = 0.0;  ///< described meanwhile
};

struct BatchFigures {
    Latencies idle;
    Latencies busy;  ///< of single searches while batches are answered
    double p99Ratio = 0.0;
    double searchesPerSecond = 0.0;  ///< of the batches, meanwhile
    std::uint64_t peak = 0;          ///< memory of the server, bytes
};

struct OverloadFigures {
    double peak = 0.0;               ///< searches answered a second, with peakClients
    double overloaded = 0.0;         ///< the same with ten times as many
    double ratio = 0.0;              ///< median of the rounds
    double refused = 0.0;            ///< searches a second meanwhile
    std::uint64_t memoryBefore = 0;  ///< of the server, bytes
    std::uint64_t memoryPeak = 0;
};

struct StartFigures {
    std::uint64_t shapes = 0;         ///< with a signature
    double servingSeconds = 0.0;      ///< from exec to SERVING; median of the rounds
    double firstAnswerSeconds = 0.0;  ///< from exec to the first answer; median of the rounds
    double processorSeconds = 0.0;    ///< until it served, all threads; median of the rounds
    std::uint64_t resident = 0;       ///< bytes after that answer; largest of the rounds
    std::uint64_t peak = 0;
    std::uint64_t cache = 0;     ///< bytes, as the server reports
    double residentRatio = 0.0;  ///< resident over cache
    std::uint64_t databaseBytes = 0;
};

struct UploadFigures {
    std::uint64_t pointBytes = 0;     ///< as sent
    double seconds = 0.0;             ///< until the server confirmed
    std::int64_t growth = 0;          ///< peak of the upload over resident before, less the points
    std::int64_t describeGrowth = 0;  ///< the same, until the scan was described
    bool exact = true;                ///< false: the peak since the start of the process
};

/// Called with stage, done and total.
using LoadProgress = std::function<void(const std::string& what, std::uint64_t done, std::uint64_t total)>;

/// Each starts its own servers. Errors: those of the server, the client and the method; kCancelled.
[[nodiscard]] Result<IngestFigures> measureIngest(const LoadSettings& settings, const LoadProgress& progress,
                                                  const RunContext& context);
[[nodiscard]] Result<LatencyFigures> measureLatency(const LoadSettings& settings,
                                                    const LoadProgress& progress, const RunContext& context);
[[nodiscard]] Result<BatchFigures> measureBatches(const LoadSettings& settings, const LoadProgress& progress,
                                                  const RunContext& context);
[[nodiscard]] Result<OverloadFigures> measureOverload(const LoadSettings& settings,
                                                      const LoadProgress& progress,
                                                      const RunContext& context);
[[nodiscard]] Result<StartFigures> measureStart(const LoadSettings& settings, const LoadProgress& progress,
                                                const RunContext& context);
[[nodiscard]] Result<UploadFigures> measureUpload(const LoadSettings& settings, const LoadProgress& progress,
                                                  const RunContext& context);

}  // namespace shapedb::bench
