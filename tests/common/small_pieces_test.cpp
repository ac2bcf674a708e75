// SPDX-License-Identifier: GPL-3.0-or-later
#include <atomic>
#include <chrono>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "common/repeating_thread.h"
#include "common/small_file.h"
#include "common/utc_text.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_directory.h"

namespace shapedb {
namespace {

TEST(RepeatingThread, WorksAgainAndAgainUntilItEnds) {
    std::atomic<int> calls{0};
    {
        const RepeatingThread thread(std::chrono::milliseconds(1), [&] { ++calls; });
        EXPECT_TRUE(testing::eventually([&] { return calls >= 3; }));
    }
    const int ended = calls;
    std::atomic<int> callsOfAnother{0};
    const RepeatingThread another(std::chrono::milliseconds(1), [&] { ++callsOfAnother; });
    ASSERT_TRUE(testing::eventually([&] { return callsOfAnother >= 20; }));
    EXPECT_EQ(calls, ended) << "one that lives has worked twenty times meanwhile";
}

TEST(RepeatingThread, EndsWithoutWaitingForItsInterval) {
    int calls = 0;
    {
        const RepeatingThread thread(std::chrono::hours(1), [&] { ++calls; });
    }
    EXPECT_EQ(calls, 0);
}

TEST(ReadSmallFile, ReadsUpToItsLimit) {
    const testing::TemporaryDirectory directory;
    const std::string path = directory.path() + "/file";
    for (const std::size_t size : {0u, 1u, 16'384u, 16'385u, 40'000u}) {
        const std::string content(size, 'x');
        std::ofstream(path) << content;
        EXPECT_EQ(readSmallFile("file", path, 40'000).value(), content);
        if (size > 0) {
            EXPECT_EQ(readSmallFile("file", path, size - 1).error().code, ErrorCode::kMalformedFile) << size;
        }
    }
}

TEST(ReadSmallFile, ReadsRegularFilesOnly) {
    const testing::TemporaryDirectory directory;
    const std::string pipe = directory.path() + "/pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    for (const std::string& path :
         {pipe, directory.path(), std::string("/dev/zero"), std::string("/nowhere")}) {
        const auto read = readSmallFile("file", path, 100);
        ASSERT_FALSE(read) << path;
        EXPECT_EQ(read.error().code, ErrorCode::kFileNotReadable);
        EXPECT_NE(read.error().message.find("file " + path), std::string::npos) << read.error().message;
    }
}

TEST(UtcText, KnowsTheCalendar) {
    EXPECT_EQ(utcText(0, "%Y-%m-%dT%H:%M:%SZ"), "1970-01-01T00:00:00Z");
    EXPECT_EQ(utcText(951'827'696, "%Y-%m-%d %H:%M UTC"), "2000-02-29 12:34 UTC");
}

}  // namespace
}  // namespace shapedb
