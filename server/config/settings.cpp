// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/settings.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <sstream>
#include <thread>
#include <utility>

#include <arpa/inet.h>

#include "core/base/return_if_error.h"

namespace shapedb::config {
namespace {

std::string quoted(const std::string& text) { return "'" + text + "'"; }

bool isHostByte(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == ':' || c == '_' ||
           c == '%';
}

Result<std::uint64_t> parseUnsigned(const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || text.empty()) {
        return fail(ErrorCode::kInvalidArgument, quoted(text) + " must be a whole number, 0 or greater");
    }
    return value;
}

struct Unit {
    const char* name;
    int shift;
};
constexpr Unit kUnits[] = {{"KiB", 10}, {"MiB", 20}, {"GiB", 30}, {"TiB", 40}};

/// "65536", "64KiB", "4GiB".
Result<std::uint64_t> parseBytes(const std::string& text) {
    std::string digits = text;
    int shift = 0;
    for (const Unit& unit : kUnits) {
        const std::string name = unit.name;
        if (text.size() > name.size() && text.compare(text.size() - name.size(), name.size(), name) == 0) {
            digits = text.substr(0, text.size() - name.size());
            shift = unit.shift;
        }
    }
    const Result<std::uint64_t> number = parseUnsigned(digits);
    if (!number || *number > (std::numeric_limits<std::uint64_t>::max() >> shift)) {
        return fail(ErrorCode::kInvalidArgument,
                    quoted(text) + " is not a number of bytes such as 65536, 64KiB, 64MiB or 4GiB");
    }
    return *number << shift;
}

std::string showBytes(std::uint64_t bytes) {
    for (auto unit = std::rbegin(kUnits); unit != std::rend(kUnits); ++unit) {
        const std::uint64_t size = std::uint64_t{1} << unit->shift;
        if (bytes >= size && bytes % size == 0) return std::to_string(bytes / size) + unit->name;
    }
    return std::to_string(bytes);
}

/// SHAPEDB_INGEST_MAX_QUEUED_JOBS of "ingest.max_queued_jobs".
std::string environmentName(const std::string& key) {
    std::string name = "SHAPEDB_";
    for (const char c : key) {
        name += c == '.' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    return name;
}

/// --ingest-max-queued-jobs of "ingest.max_queued_jobs".
std::string flagName(const std::string& key) {
    std::string name = "--" + key;
    std::replace(name.begin(), name.end(), '.', '-');
    std::replace(name.begin(), name.end(), '_', '-');
    return name;
}

Setting named(const std::string& key, SettingKind kind, std::string range, std::string help) {
    Setting setting;
    setting.key = key;
    setting.environment = environmentName(key);
    setting.flag = flagName(key);
    setting.kind = kind;
    setting.range = std::move(range);
    setting.help = std::move(help);
    return setting;
}

/// A number in [low, high]; `field` returns a reference to its place in a ServerConfig.
template <typename Field>
Setting number(const std::string& key, SettingKind kind, std::uint64_t low, std::uint64_t high, Field field,
               std::string help) {
    const auto show = [kind](std::uint64_t value) {
        return kind == SettingKind::kBytes ? showBytes(value) : std::to_string(value);
    };
    Setting setting = named(key, kind, show(low) + " to " + show(high), std::move(help));
    setting.assign = [=](ServerConfig& config, const std::string& text) -> Result<void> {
        const auto value = kind == SettingKind::kBytes ? parseBytes(text) : parseUnsigned(text);
        RETURN_IF_ERROR(value);
        if (*value < low || *value > high) {
            return fail(ErrorCode::kInvalidArgument,
                        quoted(text) + " is outside " + show(low) + " to " + show(high));
        }
        auto& place = field(config);
        place = static_cast<std::decay_t<decltype(place)>>(*value);
        return {};
    };
    setting.show = [=](const ServerConfig& config) {
        return show(static_cast<std::uint64_t>(field(const_cast<ServerConfig&>(config))));
    };
    return setting;
}

template <typename Field>
Setting choice(const std::string& key, const std::vector<std::string>& names, Field field, std::string help) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    Setting setting = named(key, SettingKind::kText, list, std::move(help));
    setting.assign = [=](ServerConfig& config, const std::string& text) -> Result<void> {
        if (std::find(names.begin(), names.end(), text) == names.end()) {
            return fail(ErrorCode::kInvalidArgument,
                        "unknown value " + quoted(text) + "; use one of " + list);
        }
        field(config) = text;
        return {};
    };
    setting.show = [=](const ServerConfig& config) { return field(const_cast<ServerConfig&>(config)); };
    return setting;
}

/// No control characters.
bool printable(const std::string& text) {
    return std::none_of(text.begin(), text.end(),
                        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

Setting listenSetting() {
    Setting setting = named("listen", SettingKind::kText, "HOST:PORT",
                            "Address to serve on. Port 0 picks a free one; IPv6 hosts need brackets.");
    setting.assign = [](ServerConfig& config, const std::string& text) -> Result<void> {
        const Result<Endpoint> endpoint = parseEndpoint(text);
        RETURN_IF_ERROR(endpoint);
        config.listen = text;
        return {};
    };
    setting.show = [](const ServerConfig& config) { return config.listen; };
    return setting;
}

/// HOST:PORT, or empty: none.
template <typename Field>
Setting optionalAddress(const std::string& key, Field field, std::string help) {
    Setting setting = named(key, SettingKind::kText, "HOST:PORT or empty", std::move(help));
    setting.assign = [=](ServerConfig& config, const std::string& text) -> Result<void> {
        if (!text.empty()) RETURN_IF_ERROR(parseEndpoint(text));
        field(config) = text;
        return {};
    };
    setting.show = [=](const ServerConfig& config) { return field(const_cast<ServerConfig&>(config)); };
    return setting;
}

Setting hostsSetting() {
    Setting setting =
        named("http.hosts", SettingKind::kText, "names or empty",
              "Host names, separated by commas, that browsers may use to reach a server without keys.");
    setting.assign = [](ServerConfig& config, const std::string& text) -> Result<void> {
        for (const std::string& name : splitNames(text)) {
            const bool good = !name.empty() && std::all_of(name.begin(), name.end(), isHostByte);
            if (!good) return fail(ErrorCode::kInvalidArgument, quoted(name) + " is not the name of a host");
        }
        config.http.hosts = text;
        return {};
    };
    setting.show = [](const ServerConfig& config) { return config.http.hosts; };
    return setting;
}

Setting dataSetting() {
    Setting setting = named("data", SettingKind::kText, "a path",
                            "Directory of the database; created when missing. One server at a time.");
    // SHAPEDB_DATA is where the tests look for public models.
    setting.environment = "SHAPEDB_DATA_DIR";
    setting.assign = [](ServerConfig& config, const std::string& text) -> Result<void> {
        if (text.empty()) return fail(ErrorCode::kInvalidArgument, "the path is empty");
        if (!printable(text)) return fail(ErrorCode::kInvalidArgument, "the path has a control character");
        config.data = text;
        return {};
    };
    setting.show = [](const ServerConfig& config) { return config.data; };
    return setting;
}

/// A text that may be empty; `what` as in "a path".
template <typename Field>
Setting optionalText(const std::string& key, const std::string& what, Field field, std::string help) {
    Setting setting = named(key, SettingKind::kText, what + " or empty", std::move(help));
    setting.assign = [=](ServerConfig& config, const std::string& text) -> Result<void> {
        if (!printable(text)) {
            return fail(ErrorCode::kInvalidArgument,
                        "the " + what.substr(what.find(' ') + 1) + " has a control character");
        }
        field(config) = text;
        return {};
    };
    setting.show = [=](const ServerConfig& config) { return field(const_cast<ServerConfig&>(config)); };
    return setting;
}

template <typename Field>
Setting optionalPath(const std::string& key, Field field, std::string help) {
    return optionalText(key, "a path", field, std::move(help));
}

std::vector<Setting> makeSettings() {
    constexpr SettingKind kInteger = SettingKind::kInteger;
    constexpr SettingKind kBytes = SettingKind::kBytes;
    constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
    constexpr std::uint64_t kTiB = std::uint64_t{1} << 40;
    using C = ServerConfig;
    return {
        listenSetting(),
        dataSetting(),
        choice(
            "role", {"all", "serve", "worker"}, [](C& c) -> std::string& { return c.role; },
            "Role among servers that share a database: serve answers calls and leaves segmenting to others, "
            "worker only segments. With SQLite only all is allowed."),
        optionalPath(
            "unix_socket", [](C& c) -> std::string& { return c.unixSocket; },
            "Unix socket to serve on as well, for the owner of this process and without API key. Empty: "
            "none."),
        optionalAddress(
            "http.listen", [](C& c) -> std::string& { return c.http.listen; },
            "Address to serve HTTP on: the API with JSON, and the web page. Empty: none."),
        hostsSetting(),
        optionalPath(
            "tls.certificate", [](C& c) -> std::string& { return c.tls.certificate; },
            "Certificate of the server and those above it (PEM). Empty: no TLS."),
        optionalPath(
            "tls.key", [](C& c) -> std::string& { return c.tls.key; },
            "Private key of the certificate (PEM, without password)."),
        optionalPath(
            "tls.client_ca", [](C& c) -> std::string& { return c.tls.clientCa; },
            "Clients need a certificate signed by one of these (PEM). Empty: they need none."),
        choice(
            "security.keys", {"network", "always"}, [](C& c) -> std::string& { return c.security.keys; },
            "Who must have an API key: callers from other machines (network), or every caller (always)."),
        optionalPath(
            "security.audit_file", [](C& c) -> std::string& { return c.security.auditFile; },
            "Log of refused calls and those of administrators (JSON). Empty: audit.log in the data "
            "directory."),
        choice(
            kAnyoneMayDoAll, {"no", "yes"}, [](C& c) -> std::string& { return c.security.anyoneMayDoAll; },
            "yes: listen beyond loopback without TLS and without API keys."),
        number(
            "ingest.threads", kInteger, 0, 256, [](C& c) -> int& { return c.ingest.threads; },
            "Segmentation workers. 0: one per processor."),
        number(
            "ingest.max_queued_jobs", kInteger, 1, 10'000'000,
            [](C& c) -> std::uint64_t& { return c.ingest.maxQueuedJobs; },
            "Most scans waiting for segmentation; more are refused with a retry hint."),
        number(
            "ingest.max_queued_bytes", kBytes, kMiB, kTiB,
            [](C& c) -> std::uint64_t& { return c.ingest.maxQueuedBytes; },
            "Most bytes of points waiting for segmentation."),
        number(
            "ingest.max_attempts", kInteger, 1, 10, [](C& c) -> int& { return c.ingest.maxAttempts; },
            "Number of times a scan may crash the process before it is quarantined (FAILED)."),
        number(
            "limits.max_points", kInteger, 4, 50'000'000,
            [](C& c) -> std::uint64_t& { return c.limits.maxPoints; }, "Most points in one scan."),
        number(
            "limits.max_k", kInteger, 1, 100'000, [](C& c) -> std::uint32_t& { return c.limits.maxK; },
            "Most hits a search may ask for."),
        number(
            "limits.max_batch", kInteger, 1, 1'000, [](C& c) -> std::uint32_t& { return c.limits.maxBatch; },
            "Most queries in one SearchBatch."),
        number(
            "limits.max_upload_bytes", kBytes, kMiB, kTiB,
            [](C& c) -> std::uint64_t& { return c.limits.maxUploadBytes; },
            "Most bytes of points that all running uploads may hold in memory together."),
        number(
            "limits.stall_seconds", kInteger, 1, 86'400, [](C& c) -> int& { return c.limits.stallSeconds; },
            "A stream is cut off when its client neither sends nor receives for this many seconds."),
        number(
            "limits.max_uploads", kInteger, 1, kMostUploads, [](C& c) -> int& { return c.limits.maxUploads; },
            "Most uploads in progress, searches by scan among them."),
        number(
            "limits.min_bytes_per_second", kInteger, 0, 1'000'000'000,
            [](C& c) -> std::uint64_t& { return c.limits.minBytesPerSecond; },
            "A stream is cut off when its client is slower than this in the long run. 0: never."),
        number(
            "limits.max_connections", kInteger, 1, 100'000,
            [](C& c) -> std::uint32_t& { return c.limits.maxConnections; },
            "Most network connections; more are closed at once."),
        number(
            "limits.idle_seconds", kInteger, 1, 86'400, [](C& c) -> int& { return c.limits.idleSeconds; },
            "A connection without calls is closed after this many seconds."),
        choice(
            "store.engine", {"sqlite", "postgres"}, [](C& c) -> std::string& { return c.store.engine; },
            "Where shapes are kept: in a file of the data directory, or on a PostgreSQL server, which "
            "several "
            "servers may share."),
        number(
            "store.readers", kInteger, 1, 64, [](C& c) -> int& { return c.store.readers; },
            "Pooled read connections to the database."),
        number(
            "store.compression_level", kInteger, 1, 19, [](C& c) -> int& { return c.store.compressionLevel; },
            "zstd level of stored points. Higher: smaller and slower."),
        optionalText(
            "postgres.uri", "a URI", [](C& c) -> std::string& { return c.postgres.uri; },
            "The database, as libpq takes it and without a password: postgresql://user@host/database."),
        optionalPath(
            "postgres.password_file", [](C& c) -> std::string& { return c.postgres.passwordFile; },
            "File whose first line is the password. Empty: PGPASSWORD or ~/.pgpass, if one is needed."),
        optionalText(
            "postgres.server_name", "a name", [](C& c) -> std::string& { return c.postgres.serverName; },
            "Unique among the servers that share the database, and the same after a restart. Empty: the name "
            "of the "
            "host."),
        number(
            "postgres.connections", kInteger, 2, 1'000, [](C& c) -> int& { return c.postgres.connections; },
            "Most connections to the database at a time."),
        number(
            "postgres.job_lease_seconds", kInteger, 1, 3'600,
            [](C& c) -> int& { return c.postgres.jobLeaseSeconds; },
            "How long a scan that a server was segmenting when it died waits for another server."),
        number(
            "postgres.timeout_seconds", kInteger, 1, 3'600,
            [](C& c) -> int& { return c.postgres.timeoutSeconds; },
            "How long the database may take to answer a statement."),
        number(
            "cluster.replicas", kInteger, 0, 16, [](C& c) -> int& { return c.cluster.replicas; },
            "Servers that hold each part of the signatures, of several that share a database. 0: every "
            "server "
            "holds all."),
        optionalAddress(
            "cluster.listen", [](C& c) -> std::string& { return c.cluster.listen; },
            "Address at which the other servers ask this one. Port 0 picks a free port."),
        optionalText(
            "cluster.advertise", "HOST or HOST:PORT",
            [](C& c) -> std::string& { return c.cluster.advertise; },
            "How they reach it, if not by that address. Without a port: that of cluster.listen."),
        number(
            "cluster.lease_milliseconds", kInteger, 300, 600'000,
            [](C& c) -> int& { return c.cluster.leaseMilliseconds; },
            "How long the part of a server that has died waits for another server."),
        optionalPath(
            "cluster.certificate", [](C& c) -> std::string& { return c.cluster.certificate; },
            "Certificate of this server towards the others (PEM). Empty: no TLS."),
        optionalPath(
            "cluster.key", [](C& c) -> std::string& { return c.cluster.key; },
            "Private key of that certificate (PEM, without password)."),
        optionalPath(
            "cluster.ca", [](C& c) -> std::string& { return c.cluster.ca; },
            "The other servers need a certificate signed by one of these (PEM)."),
        number(
            "search.threads", kInteger, 0, 256, [](C& c) -> int& { return c.search.threads; },
            "Processors shared by all searches, and query scans segmented at once. 0: all."),
        number(
            "rebuild.threads", kInteger, 0, 256, [](C& c) -> int& { return c.rebuild.threads; },
            "Processors a rebuild uses. 0: all."),
        choice(
            "log.level", {"trace", "debug", "info", "warn", "error"},
            [](C& c) -> std::string& { return c.log.level; }, "Least important lines to write."),
        choice(
            "log.format", {"text", "json"}, [](C& c) -> std::string& { return c.log.format; },
            "text for people, json (one object per line) for machines."),
        optionalPath(
            "log.file", [](C& c) -> std::string& { return c.log.file; },
            "File to append the log to. Empty: standard error."),
        optionalAddress(
            "metrics.listen", [](C& c) -> std::string& { return c.metrics.listen; },
            "Address to serve numbers for Prometheus on (http, /metrics). Empty: none."),
        choice(
            kMetricsForAnyone, {"no", "yes"}, [](C& c) -> std::string& { return c.metrics.anyoneMayRead; },
            "yes: serve the numbers beyond loopback, without TLS and without API keys."),
        number(
            "shutdown.drain_seconds", kInteger, 0, 3'600,
            [](C& c) -> int& { return c.shutdown.drainSeconds; },
            "How many seconds running calls may take to finish after SIGTERM."),
    };
}

}  // namespace

int threadsOrProcessors(int configured) noexcept {
    if (configured > 0) return configured;
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

bool Endpoint::isLoopback() const {
    in_addr address{};
    const bool v4 = ::inet_pton(AF_INET, host.c_str(), &address) == 1;
    return host == "localhost" || host == "::1" || (v4 && (ntohl(address.s_addr) >> 24) == 127);
}

std::string Endpoint::text() const {
    const bool v6 = host.find(':') != std::string::npos;
    return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

const std::vector<Setting>& settings() {
    static const std::vector<Setting> table = makeSettings();
    return table;
}

int transports(const ServerConfig& config) noexcept { return config.http.listen.empty() ? 1 : 2; }

std::vector<std::string> splitNames(const std::string& names) {
    std::vector<std::string> list;
    std::istringstream stream(names);
    for (std::string name; std::getline(stream, name, ',');) list.push_back(name);
    return list;
}

Result<Endpoint> parseEndpoint(const std::string& listen) {
    const auto bad = [&](const std::string& why) {
        return fail(ErrorCode::kInvalidArgument, quoted(listen) + " is not HOST:PORT: " + why +
                                                     "; for example 127.0.0.1:7878 or [::1]:7878");
    };
    const std::size_t colon = listen.rfind(':');
    if (colon == std::string::npos) return bad("there is no port");
    Endpoint endpoint;
    endpoint.host = listen.substr(0, colon);
    const bool bracketed =
        endpoint.host.size() > 2 && endpoint.host.front() == '[' && endpoint.host.back() == ']';
    if (bracketed) {
        endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
    } else if (endpoint.host.find(':') != std::string::npos) {
        return bad("an IPv6 host needs brackets");
    }
    if (endpoint.host.empty()) return bad("there is no host");
    if (!std::all_of(endpoint.host.begin(), endpoint.host.end(), isHostByte)) {
        return bad("the host has a character no host has");
    }
    const Result<std::uint64_t> port = parseUnsigned(listen.substr(colon + 1));
    if (!port || *port > 65'535) return bad("the port is not 0 to 65535");
    endpoint.port = static_cast<int>(*port);
    return endpoint;
}

}  // namespace shapedb::config
