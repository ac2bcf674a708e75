// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/load.h"

#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <stdlib.h>

#include "server/config/settings.h"

namespace shapedb::config {
namespace {

class Load : public ::testing::Test {
  protected:
    Load() {
        path_ = ::testing::TempDir() + "shapedb-config-XXXXXX";
        const int file = ::mkstemp(path_.data());
        EXPECT_GE(file, 0);
    }
    ~Load() override { std::remove(path_.c_str()); }

    const std::string& file(const std::string& text) {
        std::ofstream(path_) << text;
        return path_;
    }

    static Result<Loaded> loadWith(std::vector<const char*> arguments,
                                   const std::vector<std::string>& environment = {}) {
        arguments.insert(arguments.begin(), "shapedbd");
        const auto line = parseCommandLine(static_cast<int>(arguments.size()), arguments.data());
        if (!line) return fail(line.error());
        return load(*line, environment);
    }

    static void expectRefused(const Result<Loaded>& result, ErrorCode code,
                              const std::vector<std::string>& words) {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, code) << result.error().message;
        for (const std::string& word : words) {
            EXPECT_NE(result.error().message.find(word), std::string::npos)
                << word << " in: " << result.error().message;
        }
    }

    std::string path_;
};

TEST_F(Load, DefaultsApplyWhenNothingIsGiven) {
    const auto loaded = loadWith({});
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->config.listen, ServerConfig().listen);
    EXPECT_EQ(loaded->config.limits.maxPoints, 5'000'000u);
    EXPECT_EQ(loaded->config.ingest.maxAttempts, 2);
    for (const auto& [key, origin] : loaded->origins) EXPECT_EQ(origin, "default") << key;
    EXPECT_EQ(loaded->origins.size(), settings().size());
}

// Each level alone, and each against the one below it.
TEST_F(Load, FlagsOverrideEnvironmentFileAndDefaults) {
    const std::string& path = file("[limits]\nmax_k = 11\nmax_batch = 12\nmax_points = 13\n");
    const std::string config = "SHAPEDB_CONFIG=" + path;
    const auto loaded =
        loadWith({"--limits-max-points", "33"},
                 {config, "SHAPEDB_LIMITS_MAX_BATCH=22", "SHAPEDB_LIMITS_MAX_POINTS=23", "PATH=/bin"});
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->config.limits.maxK, 11u);
    EXPECT_EQ(loaded->config.limits.maxBatch, 22u);
    EXPECT_EQ(loaded->config.limits.maxPoints, 33u);
    EXPECT_EQ(loaded->origins.at("limits.max_k"), path + " line 2");
    EXPECT_EQ(loaded->origins.at("limits.max_batch"), "environment SHAPEDB_LIMITS_MAX_BATCH");
    EXPECT_EQ(loaded->origins.at("limits.max_points"), "flag --limits-max-points");
    EXPECT_EQ(loaded->origins.at("search.threads"), "default");
}

TEST_F(Load, ConfigFlagOverridesItsVariable) {
    const std::string& path = file("[limits]\nmax_k = 11\n");
    const auto loaded = loadWith({"--config", path.c_str()}, {"SHAPEDB_CONFIG=/nowhere/at/all"});
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->config.limits.maxK, 11u);
}

// Round trip of every setting through every source: the value shown is read back as it is.
TEST_F(Load, EverySettingIsReadFromEverySource) {
    // A certificate without its key, or a database without its engine, and the other way round, are refused.
    ServerConfig partners;
    partners.tls = {"c.pem", "k.pem", ""};
    const std::vector<const char*> partnerFlags = {"--tls-certificate", "c.pem", "--tls-key", "k.pem"};
    for (const Setting& setting : settings()) {
        std::vector<const char*> with;
        if (setting.key == "tls.client_ca") with = partnerFlags;
        if (setting.key == "tls.certificate") with.assign(partnerFlags.begin() + 2, partnerFlags.end());
        if (setting.key == "tls.key") with.assign(partnerFlags.begin(), partnerFlags.begin() + 2);
        if (setting.key == "store.engine") with = {"--postgres-uri", "host=db"};
        if (setting.key == "postgres.uri") with = {"--store-engine", "postgres"};
        const bool needsPostgres = setting.key == "role" || setting.key == "cluster.replicas";
        if (needsPostgres) with = {"--store-engine", "postgres", "--postgres-uri", "host=db"};
        const std::vector<const char*> clusterFlags = {"--cluster-certificate", "c", "--cluster-key", "k",
                                                       "--cluster-ca",          "a"};
        for (std::size_t i = 0; i < clusterFlags.size(); i += 2) {
            if (clusterFlags[i] != setting.flag) continue;
            with = clusterFlags;
            with.erase(with.begin() + static_cast<std::ptrdiff_t>(i),
                       with.begin() + static_cast<std::ptrdiff_t>(i) + 2);
        }
        for (const int source : {0, 1, 2}) {
            ServerConfig probe;
            // A value other than the default, found among a few candidates.
            std::string text;
            for (const char* candidate : {"3", "5", "2MiB", "/some/where", "localhost:1", "warn", "json",
                                          "200MiB", "8GiB", "always", "yes", "postgres", "worker", "500"}) {
                ServerConfig tried;
                tried.tls = partners.tls;
                if (!with.empty() && setting.key.rfind("cluster.", 0) == 0 && !needsPostgres) {
                    tried.cluster.certificate = tried.cluster.key = tried.cluster.ca = "c";
                }
                if (needsPostgres) {
                    tried.store.engine = "postgres";
                    tried.postgres.uri = "host=db";
                }
                if (setting.key == "store.engine") tried.postgres.uri = "host=db";
                if (setting.key == "postgres.uri") tried.store.engine = "postgres";
                if (setting.assign(tried, candidate) && setting.show(tried) != setting.show(probe) &&
                    validateTogether(tried)) {
                    text = candidate;
                    break;
                }
            }
            ASSERT_FALSE(text.empty()) << setting.key;
            Result<Loaded> loaded = fail(ErrorCode::kInternal, "");
            if (source == 0) {
                const std::size_t dot = setting.key.find('.');
                const bool quotes = setting.kind != SettingKind::kInteger;
                const std::string value = quotes ? "\"" + text + "\"" : text;
                const std::string& path = dot == std::string::npos
                                              ? file(setting.key + " = " + value + "\n")
                                              : file("[" + setting.key.substr(0, dot) + "]\n" +
                                                     setting.key.substr(dot + 1) + " = " + value + "\n");
                with.insert(with.end(), {"--config", path.c_str()});
                loaded = loadWith(with);
                with.resize(with.size() - 2);
            } else if (source == 1) {
                loaded = loadWith(with, {setting.environment + "=" + text});
            } else {
                with.insert(with.end(), {setting.flag.c_str(), text.c_str()});
                loaded = loadWith(with);
            }
            ASSERT_TRUE(loaded) << setting.key << ": " << loaded.error().message;
            ServerConfig expected;
            ASSERT_TRUE(setting.assign(expected, text));
            EXPECT_EQ(setting.show(loaded->config), setting.show(expected)) << setting.key;
            EXPECT_NE(loaded->origins.at(setting.key), "default") << setting.key;
        }
    }
}

TEST_F(Load, DescriptionReadsBackAsTheSameConfiguration) {
    const auto loaded = loadWith(
        {"--log-file", "/a \"b\"\\c.log", "--limits-max-k", "9", "--limits-max-upload-bytes", "65MiB"});
    ASSERT_TRUE(loaded) << loaded.error().message;
    const std::string text = describe(*loaded);
    EXPECT_NE(text.find("limits.max_k = 9  # flag --limits-max-k\n"), std::string::npos) << text;
    const auto again = loadWith({"--config", file(text).c_str()});
    ASSERT_TRUE(again) << again.error().message;
    for (const Setting& setting : settings()) {
        EXPECT_EQ(setting.show(again->config), setting.show(loaded->config)) << setting.key;
    }
}

TEST_F(Load, ExampleFileHasEveryKeyWithItsDefault) {
    const auto loaded = loadWith({"--config", SHAPEDB_EXAMPLE_CONFIG});
    ASSERT_TRUE(loaded) << loaded.error().message;
    const ServerConfig defaults;
    for (const Setting& setting : settings()) {
        EXPECT_EQ(setting.show(loaded->config), setting.show(defaults)) << setting.key;
        EXPECT_NE(loaded->origins.at(setting.key), "default")
            << setting.key << " is missing from the example";
    }
}

TEST_F(Load, UnknownKeysAreRefusedWithTheirLine) {
    expectRefused(loadWith({"--config", file("listen = \"a:1\"\nlisen = \"b:2\"\n").c_str()}),
                  ErrorCode::kInvalidArgument,
                  {path_ + " line 2", "unknown key lisen: did you mean 'listen'? shapedbd"});
    expectRefused(loadWith({"--config", file("[ingest]\n\nthread = 2\n").c_str()}),
                  ErrorCode::kInvalidArgument, {"line 3", "unknown key ingest.thread"});
    expectRefused(loadWith({"--config", file("[ingst]\nthreads = 2\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"line 1", "unknown key ingst"});
    expectRefused(loadWith({"--config", file("ingest = 3\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"ingest"});
    expectRefused(loadWith({"--config", file("[listen]\nx = 3\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"listen"});
}

TEST_F(Load, WhatWasProbablyMeantIsTold) {
    expectRefused(loadWith({"--lisen", "a:1"}), ErrorCode::kInvalidArgument,
                  {"unknown option '--lisen': did you mean '--listen'? shapedbd --help"});
    expectRefused(loadWith({"--tls-certifcate=x"}), ErrorCode::kInvalidArgument,
                  {"unknown option '--tls-certifcate': did you mean '--tls-certificate'?"});
    expectRefused(loadWith({"--zzzzzzzz"}), ErrorCode::kInvalidArgument,
                  {"unknown option '--zzzzzzzz'; shapedbd --help"});
    expectRefused(loadWith({}, {"SHAPEDB_LISEN=a:1"}), ErrorCode::kInvalidArgument,
                  {"SHAPEDB_LISEN: did you mean 'SHAPEDB_LISTEN'? If not, unset it"});
    expectRefused(loadWith({}, {"SHAPEDB_ZZZZZZZZZZZZ=1"}), ErrorCode::kInvalidArgument,
                  {"SHAPEDB_ZZZZZZZZZZZZ: unset it; shapedbd"});
}

TEST_F(Load, WrongTypesAreRefusedWithTheirLine) {
    for (const char* value : {"\"4\"", "4.0", "true", "[4]", "2004-01-01"}) {
        expectRefused(
            loadWith({"--config", file(std::string("[ingest]\nthreads = ") + value + "\n").c_str()}),
            ErrorCode::kInvalidArgument, {"line 2", "ingest.threads", "whole number"});
    }
    expectRefused(loadWith({"--config", file("data = 3\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"line 1", "data", "quotes"});
}

TEST_F(Load, BrokenFilesAreRefused) {
    expectRefused(loadWith({"--config", file("[ingest]\nthreads = \n").c_str()}), ErrorCode::kMalformedFile,
                  {"line 2"});
    expectRefused(loadWith({"--config", file("[limits]\nmax_k = 1\nmax_k = 2\n").c_str()}),
                  ErrorCode::kMalformedFile, {"line 3"});
    expectRefused(loadWith({"--config", "/nowhere/at/all.toml"}), ErrorCode::kFileNotReadable,
                  {"/nowhere/at/all.toml"});
    expectRefused(loadWith({"--config", ::testing::TempDir().c_str()}), ErrorCode::kFileNotReadable, {});
}

TEST_F(Load, ValuesOutsideTheirRangeAreRefusedAtEverySource) {
    expectRefused(loadWith({"--config", file("[limits]\nmax_k = 0\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"line 2", "limits.max_k", "1 to 100000"});
    expectRefused(loadWith({"--config", file("[limits]\nmax_k = -1\n").c_str()}), ErrorCode::kInvalidArgument,
                  {"limits.max_k"});
    expectRefused(loadWith({}, {"SHAPEDB_STORE_READERS=65"}), ErrorCode::kInvalidArgument,
                  {"environment SHAPEDB_STORE_READERS", "store.readers", "1 to 64"});
    expectRefused(loadWith({"--log-level", "loud"}), ErrorCode::kInvalidArgument,
                  {"flag --log-level", "'loud'", "trace, debug, info, warn, error"});
    // Even if another source overrides it.
    expectRefused(loadWith({"--limits-max-k", "5"}, {"SHAPEDB_LIMITS_MAX_K=none"}),
                  ErrorCode::kInvalidArgument, {"SHAPEDB_LIMITS_MAX_K"});
}

TEST_F(Load, UnknownVariablesAreRefused) {
    expectRefused(loadWith({}, {"SHAPEDB_INGEST_THREAD=2"}), ErrorCode::kInvalidArgument,
                  {"SHAPEDB_INGEST_THREAD"});
    expectRefused(loadWith({}, {"SHAPEDB_=2"}), ErrorCode::kInvalidArgument, {"SHAPEDB_"});
    EXPECT_TRUE(loadWith({}, {"SHAPEDB_DATA=/models", "SHAPEDB_SERVER=host:1", "SHAPEDBX=1", "OTHER=1"}))
        << "read by other programs";
}

TEST_F(Load, UnknownFlagsAreRefused) {
    expectRefused(loadWith({"--threads", "2"}), ErrorCode::kInvalidArgument, {"--threads", "--help"});
    expectRefused(loadWith({"positional"}), ErrorCode::kInvalidArgument, {"positional"});
    expectRefused(loadWith({"--listen"}), ErrorCode::kInvalidArgument, {"--listen"});
}

TEST_F(Load, RefusesSettingsThatContradictEachOther) {
    expectRefused(loadWith({"--limits-max-upload-bytes", "1MiB"}), ErrorCode::kInvalidArgument,
                  {"limits.max_upload_bytes", "limits.max_points"});
    expectRefused(loadWith({"--ingest-max-queued-bytes", "1MiB"}), ErrorCode::kInvalidArgument,
                  {"ingest.max_queued_bytes", "limits.max_points"});
    EXPECT_TRUE(loadWith({"--limits-max-upload-bytes", "1MiB", "--limits-max-points", "80000"}));
    expectRefused(loadWith({"--tls-certificate", "c"}), ErrorCode::kInvalidArgument, {"tls.key"});
    expectRefused(loadWith({"--tls-key", "k"}), ErrorCode::kInvalidArgument, {"tls.certificate"});
    expectRefused(loadWith({"--tls-client-ca", "a"}), ErrorCode::kInvalidArgument, {"tls.client_ca"});
}

TEST_F(Load, ServersThatHoldPartsNeedADatabaseAndAnAddress) {
    const auto withDatabase = [&](std::vector<const char*> flags) {
        flags.insert(flags.end(), {"--store-engine", "postgres", "--postgres-uri", "host=db"});
        return loadWith(flags);
    };
    const auto refused = ErrorCode::kInvalidArgument;
    expectRefused(loadWith({"--role", "worker"}), refused, {"role = worker", "store.engine"});
    expectRefused(loadWith({"--cluster-replicas", "1"}), refused, {"cluster.replicas", "store.engine"});
    expectRefused(withDatabase({"--cluster-replicas", "1", "--cluster-listen", ""}), refused,
                  {"cluster.listen"});
    expectRefused(withDatabase({"--cluster-certificate", "c.pem"}), refused, {"cluster.key", "cluster.ca"});
    expectRefused(withDatabase({"--cluster-replicas", "1", "--cluster-listen", "10.1.2.3:7979"}), refused,
                  {"10.1.2.3:7979", "cluster.ca"});
    expectRefused(withDatabase({"--cluster-replicas", "1", "--cluster-listen", "0.0.0.0:7979"}), refused,
                  {"cluster.advertise"});
    EXPECT_TRUE(withDatabase({"--cluster-replicas", "1"}));
    EXPECT_TRUE(
        withDatabase({"--cluster-replicas", "1", "--cluster-listen", "0.0.0.0:7979", "--cluster-advertise",
                      "one", "--cluster-certificate", "c", "--cluster-key", "k", "--cluster-ca", "a"}));
}

TEST_F(Load, BeyondThisMachineTlsIsNeeded) {
    const std::string anyone = "--security-anyone-on-the-network-may-read-change-and-delete-everything";
    for (const char* flag : {"--listen", "--http-listen"}) {
        for (const char* address :
             {"0.0.0.0:1", "[::]:1", "192.168.1.2:1", "shapes.example:1", "[::ffff:1.2.3.4]:1"}) {
            expectRefused(loadWith({flag, address}), ErrorCode::kInvalidArgument,
                          {std::string(flag + 2, 4), address, "tls.certificate", "docs/security.md"});
            const auto secured = loadWith({flag, address, "--tls-certificate", "c", "--tls-key", "k"});
            ASSERT_TRUE(secured) << secured.error().message;
            EXPECT_TRUE(keysRequired(secured->config));
            const auto open = loadWith({flag, address, anyone.c_str(), "yes"});
            ASSERT_TRUE(open) << open.error().message;
            EXPECT_FALSE(keysRequired(open->config));
        }
        for (const char* address : {"127.0.0.1:1", "127.9.9.9:1", "[::1]:1", "localhost:1"}) {
            const auto loaded = loadWith({flag, address});
            ASSERT_TRUE(loaded) << loaded.error().message;
            EXPECT_FALSE(keysRequired(loaded->config));
            EXPECT_TRUE(keysRequired(loadWith({flag, address, "--security-keys", "always"})->config));
        }
    }
}

TEST_F(Load, MetricsLeaveThisMachineOnlyWhenTold) {
    const char* flag = "--metrics-listen";
    for (const char* address : {"0.0.0.0:1", "[::]:1", "192.168.1.2:1", "shapes.example:1"}) {
        // TLS is of the API: metrics have none.
        for (const bool tls : {false, true}) {
            std::vector<const char*> flags{flag, address};
            if (tls) flags.insert(flags.end(), {"--tls-certificate", "c", "--tls-key", "k"});
            expectRefused(loadWith(flags), ErrorCode::kInvalidArgument,
                          {"metrics.listen", address, "metrics.anyone_on_the_network_may_read"});
            flags.insert(flags.end(), {"--metrics-anyone-on-the-network-may-read", "yes"});
            EXPECT_TRUE(loadWith(flags)) << address;
        }
    }
    for (const char* address : {"127.0.0.1:1", "[::1]:1", "localhost:1", ""})
        EXPECT_TRUE(loadWith({flag, address})) << address;
}

TEST_F(Load, HttpIsOffAndKnowsItsNames) {
    EXPECT_EQ(loadWith({})->config.http.listen, "");
    EXPECT_EQ(transports(loadWith({})->config), 1);
    EXPECT_EQ(transports(loadWith({"--http-listen", "127.0.0.1:0"})->config), 2);
    const auto named = loadWith({"--http-hosts", "a.example,b"});
    ASSERT_TRUE(named);
    EXPECT_EQ(splitNames(named->config.http.hosts), (std::vector<std::string>{"a.example", "b"}));
    EXPECT_TRUE(splitNames("").empty());
    for (const char* bad : {"a,,b", "http://a", "a b", "a/b", ",a"}) {
        expectRefused(loadWith({"--http-hosts", bad}), ErrorCode::kInvalidArgument,
                      {"http.hosts", "name of a host"});
    }
}

TEST(ParseCommandLine, ParsesHelpVersionAndCheck) {
    const auto parse = [](std::vector<const char*> arguments) {
        arguments.insert(arguments.begin(), "shapedbd");
        return parseCommandLine(static_cast<int>(arguments.size()), arguments.data());
    };
    const auto help = parse({"--help"});
    ASSERT_TRUE(help);
    EXPECT_EQ(help->action, Action::kPrint);
    for (const Setting& setting : settings()) {
        EXPECT_NE(help->text.find(setting.flag), std::string::npos) << setting.flag;
        EXPECT_NE(help->text.find(setting.environment), std::string::npos) << setting.environment;
    }
    EXPECT_EQ(parse({"--version"})->text, std::string("shapedbd ") + version() + "\n");
    EXPECT_EQ(parse({"--check-config"})->action, Action::kCheckConfig);
    EXPECT_EQ(parse({})->action, Action::kServe);
}

}  // namespace
}  // namespace shapedb::config
