// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/logger.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace shapedb::telemetry {
namespace {

// What a client may put into a key to break a line or forge one.
const std::string kHostile = std::string("a\"b\\c\nlevel=error\t\x01\x7f ") + '\0' + "\xff é";

TEST(FormatText, QuotesValuesThatAreNotPlainWords) {
    EXPECT_EQ(formatText("call", {{"rpc", std::string("AddShape")},
                                  {"key", std::string("two words")},
                                  {"empty", std::string()},
                                  {"n", std::int64_t{-3}},
                                  {"u", std::uint64_t{7}},
                                  {"ms", 1.5},
                                  {"yes", true}}),
              R"(call rpc=AddShape key="two words" empty="" n=-3 u=7 ms=1.5 yes=true)");
}

TEST(FormatText, StaysOneLine) {
    const std::string line = formatText("message\nforged", {{"key", kHostile}});
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_EQ(line.find('\0'), std::string::npos);
    EXPECT_NE(line.find(R"(key="a\"b\\c\nlevel=error)"), std::string::npos) << line;
}

TEST(FormatJson, IsJsonWhateverTheValues) {
    const std::string text = "{" +
                             formatJson("m\"", {{"key", kHostile},
                                                {"nan", std::nan("")},
                                                {"inf", std::numeric_limits<double>::infinity()},
                                                {"n", std::numeric_limits<std::int64_t>::min()},
                                                {"u", std::numeric_limits<std::uint64_t>::max()}}) +
                             "}";
    const auto json = nlohmann::json::parse(text);
    EXPECT_EQ(json["message"], "m\"");
    EXPECT_TRUE(json["nan"].is_null());
    EXPECT_TRUE(json["inf"].is_null());
    EXPECT_EQ(json["n"].get<std::int64_t>(), std::numeric_limits<std::int64_t>::min());
    EXPECT_EQ(json["u"].get<std::uint64_t>(), std::numeric_limits<std::uint64_t>::max());
    EXPECT_EQ(json["key"].get<std::string>().substr(0, 6), "a\"b\\c\n");
}

class LogFile : public ::testing::Test {
  protected:
    LogFile() { std::remove(path_.c_str()); }
    ~LogFile() override { std::remove(path_.c_str()); }

    std::vector<std::string> lines() const {
        std::ifstream stream(path_);
        std::vector<std::string> all;
        for (std::string line; std::getline(stream, line);) all.push_back(line);
        return all;
    }

    std::string path_ = ::testing::TempDir() + "shapedb-log-" + std::to_string(::getpid());
};

TEST_F(LogFile, DropsLevelsBelowTheConfiguredOne) {
    const auto log = makeLogger({Level::kWarn, false, path_});
    ASSERT_TRUE(log);
    (*log)->debug("one");
    (*log)->info("two");
    (*log)->warn("three");
    (*log)->error("four", fieldsOf(Error{ErrorCode::kNotFound, "no such thing"}));
    ASSERT_EQ(lines().size(), 2u);
    EXPECT_NE(lines()[0].find("warn"), std::string::npos);
    EXPECT_NE(lines()[1].find("four error=not_found reason=\"no such thing\""), std::string::npos)
        << lines()[1];
}

TEST_F(LogFile, IsAppendedTo) {
    { (*makeLogger({Level::kInfo, false, path_}))->info("first"); }
    { (*makeLogger({Level::kInfo, false, path_}))->info("second"); }
    EXPECT_EQ(lines().size(), 2u);
}

TEST_F(LogFile, ThreadsWriteWholeLines) {
    const auto log = makeLogger({Level::kInfo, true, path_});
    ASSERT_TRUE(log);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            for (int i = 0; i < 200; ++i) (*log)->info("m", {{"key", kHostile}, {"t", std::int64_t{t}}});
        });
    }
    for (std::thread& thread : threads) thread.join();
    const auto all = lines();
    EXPECT_EQ(all.size(), 800u);
    for (const std::string& line : all) {
        const auto json = nlohmann::json::parse(line);
        EXPECT_EQ(json["level"], "info");
        EXPECT_EQ(json["time"].get<std::string>().size(), std::string("2004-01-01T00:00:00.000Z").size());
    }
}

TEST(MakeLogger, RefusesAFileItCannotWrite) {
    const auto log = makeLogger({Level::kInfo, false, "/proc/none/at/all"});
    ASSERT_FALSE(log);
    EXPECT_EQ(log.error().code, ErrorCode::kFileNotWritable);
}

TEST(LevelFromName, KnowsAllLevels) {
    for (const char* name : {"trace", "debug", "info", "warn", "error"})
        EXPECT_TRUE(levelFromName(name)) << name;
    EXPECT_FALSE(levelFromName("Info"));
    EXPECT_FALSE(levelFromName(""));
}

}  // namespace
}  // namespace shapedb::telemetry
