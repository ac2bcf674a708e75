// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/settings.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>

namespace shapedb::config {
namespace {

const Setting& settingOf(const std::string& key) {
    const auto& all = settings();
    return *std::find_if(all.begin(), all.end(), [&](const Setting& s) { return s.key == key; });
}

TEST(Settings, NamesAreUniqueAndDerivedFromTheKey) {
    std::set<std::string> names;
    for (const Setting& setting : settings()) {
        EXPECT_TRUE(names.insert(setting.key).second) << setting.key;
        EXPECT_TRUE(names.insert(setting.environment).second) << setting.environment;
        EXPECT_TRUE(names.insert(setting.flag).second) << setting.flag;
        EXPECT_EQ(setting.flag.rfind("--", 0), 0u);
        EXPECT_FALSE(setting.help.empty());
        EXPECT_FALSE(setting.range.empty());
    }
    EXPECT_EQ(settingOf("ingest.max_queued_jobs").environment, "SHAPEDB_INGEST_MAX_QUEUED_JOBS");
    EXPECT_EQ(settingOf("ingest.max_queued_jobs").flag, "--ingest-max-queued-jobs");
    EXPECT_EQ(names.count("SHAPEDB_DATA"), 0u) << "that one means the public models";
}

TEST(Settings, DefaultsAreValid) {
    const ServerConfig defaults;
    for (const Setting& setting : settings()) {
        ServerConfig config;
        EXPECT_TRUE(setting.assign(config, setting.show(defaults))) << setting.key;
        EXPECT_EQ(setting.show(config), setting.show(defaults)) << setting.key;
    }
    EXPECT_TRUE(validateTogether(defaults));
}

// docs/configuration.md agrees with the table.
TEST(Settings, DocumentationListsEverySetting) {
    std::ifstream stream(SHAPEDB_CONFIGURATION_PAGE);
    const std::string page((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    ASSERT_FALSE(page.empty());
    const ServerConfig defaults;
    for (const Setting& setting : settings()) {
        const std::string shown = setting.show(defaults);
        const bool quoted = setting.key == "listen" || setting.key == "data";
        const std::string value = shown.empty() ? "empty" : quoted ? "`" + shown + "`" : shown;
        const std::string row = "| `" + setting.key + "` | " + value + " | " + setting.range + " | ";
        EXPECT_NE(page.find(row), std::string::npos) << row;
    }
}

TEST(Settings, RefusedValuesChangeNothing) {
    for (const Setting& setting : settings()) {
        ServerConfig config;
        const std::string before = setting.show(config);
        for (const std::string& bad : {std::string("\x01"), std::string(50, '9')}) {
            if (setting.assign(config, bad)) {
                EXPECT_EQ(setting.kind, SettingKind::kText) << setting.key;
                config = ServerConfig();
                continue;
            }
            EXPECT_EQ(setting.show(config), before) << setting.key;
        }
    }
}

TEST(Settings, WholeNumbersOnly) {
    const Setting& threads = settingOf("ingest.threads");
    ServerConfig config;
    for (const char* bad : {"", " 1", "1 ", "+1", "-1", "1.0", "0x1", "1e2", "257", "99999999999999999999"}) {
        EXPECT_FALSE(threads.assign(config, bad)) << bad;
    }
    for (const char* good : {"0", "256", "007"}) EXPECT_TRUE(threads.assign(config, good)) << good;
}

TEST(Settings, BytesHaveUnits) {
    const Setting& bytes = settingOf("ingest.max_queued_bytes");
    ServerConfig config;
    const auto value = [&](const char* text) {
        return bytes.assign(config, text) ? config.ingest.maxQueuedBytes : std::uint64_t{0};
    };
    EXPECT_EQ(value("1048576"), 1'048'576u);
    EXPECT_EQ(value("1024KiB"), 1'048'576u);
    EXPECT_EQ(value("3MiB"), 3'145'728u);
    EXPECT_EQ(value("2GiB"), 2'147'483'648u);
    EXPECT_EQ(value("1TiB"), 1'099'511'627'776u);
    for (const char* bad :
         {"", "MiB", "1 MiB", "1MB", "1mib", "-1MiB", "1.5GiB", "99999999999TiB", "1023KiB", "2TiB"}) {
        EXPECT_EQ(value(bad), 0u) << bad;
    }
    ASSERT_TRUE(bytes.assign(config, "1536MiB"));
    EXPECT_EQ(bytes.show(config), "1536MiB");
    ASSERT_TRUE(bytes.assign(config, "1048577"));
    EXPECT_EQ(bytes.show(config), "1048577");
}

TEST(Endpoint, ParsesAndPrints) {
    const auto v4 = parseEndpoint("127.0.0.1:0");
    ASSERT_TRUE(v4);
    EXPECT_EQ(v4->host, "127.0.0.1");
    EXPECT_EQ(v4->port, 0);
    EXPECT_TRUE(v4->isLoopback());
    const auto v6 = parseEndpoint("[::1]:65535");
    ASSERT_TRUE(v6);
    EXPECT_EQ(v6->host, "::1");
    EXPECT_EQ(v6->text(), "[::1]:65535");
    EXPECT_TRUE(v6->isLoopback());
    EXPECT_TRUE(parseEndpoint("localhost:1")->isLoopback());
    EXPECT_FALSE(parseEndpoint("0.0.0.0:1")->isLoopback());
    EXPECT_FALSE(parseEndpoint("shapes.example.org:1")->isLoopback());
    EXPECT_FALSE(parseEndpoint("127.example.org:1")->isLoopback());
    for (const char* bad :
         {"", "localhost", ":1", "localhost:", "localhost:65536", "localhost:-1", "localhost:x", "::1:80",
          "[]:1", "a b:1", "unix:/tmp/x:1", "host/path:1", "[::1]"}) {
        EXPECT_FALSE(parseEndpoint(bad)) << bad;
    }
}

TEST(Threads, ZeroMeansAllProcessors) {
    EXPECT_EQ(threadsOrProcessors(3), 3);
    EXPECT_GE(threadsOrProcessors(0), 1);
}

}  // namespace
}  // namespace shapedb::config
