// Everything an operator can set, with its defaults. docs/configuration.md is the page for
// people; settings.cpp is the one table that names, documents and checks each key.
#pragma once

#include <cstdint>
#include <string>

namespace shapedb::config {

struct ServerConfig {
    /// HOST:PORT; IPv6 hosts in brackets. Port 0 picks a free port.
    std::string listen = "127.0.0.1:7878";
    /// Directory of the database; created when missing.
    std::string data = "shapedb-data";

    struct Ingest {
        int threads = 0;  ///< segmentation workers; 0: one for each processor
        std::uint64_t maxQueuedJobs = 10'000;
        std::uint64_t maxQueuedBytes = std::uint64_t{4} << 30;  ///< points of queued scans, uncompressed
        int maxAttempts = 2;  ///< starts of one job after which it is quarantined
    } ingest;

    struct Limits {
        std::uint64_t maxPoints = 5'000'000;  ///< of one scan
        std::uint32_t maxK = 1'000;           ///< hits of one search
        std::uint32_t maxBatch = 1'000;       ///< queries of one SearchBatch
        /// Points of all uploads being received at one moment, bytes.
        std::uint64_t maxUploadBytes = std::uint64_t{1} << 30;
        int stallSeconds = 60;  ///< a client that neither sends nor takes anything so long is cut off
    } limits;

    struct Store {
        int readers = 4;           ///< pooled read connections
        int compressionLevel = 1;  ///< zstd level of stored points
    } store;

    struct Search {
        int threads = 0;  ///< shared by all searches; 0: one for each processor
    } search;

    struct Rebuild {
        int threads = 1;  ///< 0: one for each processor
    } rebuild;

    struct Log {
        std::string level = "info";   ///< trace, debug, info, warn, error
        std::string format = "text";  ///< text or json
        std::string file;             ///< empty: standard error
    } log;

    struct Shutdown {
        int drainSeconds = 10;  ///< how long running calls may take to finish
    } shutdown;
};

/// `configured`, or the number of processors (at least 1) when it is 0.
[[nodiscard]] int threadsOrProcessors(int configured) noexcept;

/// Host and port of a `listen` value.
struct Endpoint {
    std::string host;  ///< without brackets
    int port = 0;
    [[nodiscard]] bool isLoopback() const;
    /// HOST:PORT with brackets around an IPv6 host.
    [[nodiscard]] std::string text() const;
};

}  // namespace shapedb::config
