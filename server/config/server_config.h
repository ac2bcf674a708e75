// SPDX-License-Identifier: GPL-3.0-or-later
// Everything an operator can configure, with its defaults. docs/configuration.md documents it;
// settings.cpp is the one table that names, describes and checks each key.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace shapedb::config {

/// Most that limits.max_uploads may say.
constexpr int kMostUploads = 96;

struct ServerConfig {
    /// HOST:PORT; IPv6 hosts in brackets. Port 0 picks a free port.
    std::string listen = "127.0.0.1:7878";
    /// Directory of the database; created when missing.
    std::string data = "shapedb-data";
    /// "all"; "serve": leaves the segmentation of what was uploaded to others; "worker": does nothing else.
    std::string role = "all";
    /// Path of a Unix socket to serve on as well, for administrators of this machine; empty: none.
    std::string unixSocket;

    struct Tls {
        std::string certificate;  ///< PEM file; empty: no TLS
        std::string key;          ///< PEM file
        std::string clientCa;  ///< PEM file: clients need a certificate signed by one of these; empty: none
    } tls;

    struct Http {
        std::string listen;  ///< HOST:PORT; empty: no HTTP
        std::string hosts;   ///< names by which browsers may ask for it, separated by commas
    } http;

    struct Security {
        std::string keys = "network";       ///< who must have an API key: "network" or "always"
        std::string anyoneMayDoAll = "no";  ///< "yes": beyond loopback without TLS and keys
        std::string auditFile;              ///< empty: audit.log in `data`
    } security;

    struct Ingest {
        int threads = 0;  ///< segmentation workers; 0: one per processor
        std::uint64_t maxQueuedJobs = 10'000;
        std::uint64_t maxQueuedBytes = std::uint64_t{4}
                                       << 30;  ///< of the points of queued scans, uncompressed
        int maxAttempts = 2;                   ///< crashes after which a scan is quarantined
    } ingest;

    struct Limits {
        std::uint64_t maxPoints = 5'000'000;  ///< of one scan
        std::uint32_t maxK = 1'000;           ///< hits of one search
        std::uint32_t maxBatch = 1'000;       ///< queries of one SearchBatch
        /// Bytes of points that all uploads in progress may hold.
        std::uint64_t maxUploadBytes = std::uint64_t{1} << 30;
        int maxUploads = 64;    ///< uploads in progress
        int stallSeconds = 60;  ///< after which a client that neither sends nor reads is cut off
        std::uint64_t minBytesPerSecond = 1'024;  ///< of a stream; slower clients are cut off. 0: any
        std::uint32_t maxConnections = 1'000;     ///< network connections
        int idleSeconds = 300;                    ///< after which a connection without calls is closed
    } limits;

    struct Store {
        std::string engine = "sqlite";  ///< "sqlite": a file in `data`; "postgres"
        int readers = 4;                ///< pooled read connections; sqlite only
        int compressionLevel = 1;       ///< zstd level of stored points
    } store;

    struct Postgres {
        std::string uri;           ///< of libpq, without a password; must be set for the engine postgres
        std::string passwordFile;  ///< empty: as libpq finds one (PGPASSWORD, ~/.pgpass)
        std::string serverName;  ///< unique among the servers that share the database; empty: the host's name
        int connections = 8;     ///< at most
        int jobLeaseSeconds = 60;  ///< how long the scans of a server that has died wait for another
        int timeoutSeconds = 30;   ///< for a connection, and for each statement
    } postgres;

    /// Shards over several servers; with the engine postgres only.
    struct Cluster {
        int replicas = 0;                    ///< of each shard; 0: every server holds all signatures
        std::string listen = "127.0.0.1:0";  ///< HOST:PORT at which other servers ask this one
        std::string advertise;               ///< HOST[:PORT] by which they reach it; empty: as `listen`
        int leaseMilliseconds = 3'000;
        std::string certificate;  ///< PEM file of this server, for both sides; empty: no TLS
        std::string key;          ///< PEM file
        std::string ca;           ///< PEM file: who signs the certificates of the servers
    } cluster;

    struct Search {
        int threads = 0;  ///< shared by all searches; 0: one per processor
    } search;

    struct Rebuild {
        int threads = 1;  ///< 0: one per processor
    } rebuild;

    struct Log {
        std::string level = "info";   ///< trace, debug, info, warn, error
        std::string format = "text";  ///< text or json
        std::string file;             ///< empty: standard error
    } log;

    struct Metrics {
        std::string listen;                ///< HOST:PORT; empty: none
        std::string anyoneMayRead = "no";  ///< "yes": beyond loopback too
    } metrics;

    struct Shutdown {
        int drainSeconds = 10;  ///< time for running calls to finish
    } shutdown;
};

/// Whether callers must have an API key: it is demanded, or one of the addresses is beyond this machine.
[[nodiscard]] bool keysRequired(const ServerConfig& config);

/// How many servers share the connections that the process may have: gRPC, and HTTP if it listens.
[[nodiscard]] int transports(const ServerConfig& config) noexcept;

/// The names of http.hosts.
[[nodiscard]] std::vector<std::string> splitNames(const std::string& names);

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
