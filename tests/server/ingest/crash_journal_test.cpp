// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_journal.h"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/server/support/fixtures.h"

namespace shapedb::ingest {
namespace {

class Journal : public ::testing::Test {
  protected:
    ~Journal() override { std::remove(path.c_str()); }

    static store::Shape shape(std::int64_t id, std::int64_t pointsVersion = 1) {
        store::Shape result;
        result.id = id;
        result.pointsVersion = pointsVersion;
        return result;
    }

    /// The journal as the next process reads it if this one crashes now, over these scans.
    std::unique_ptr<CrashJournal> afterCrash(const std::vector<store::Crash>& crashes) {
        return std::make_unique<CrashJournal>(path, crashes, log);
    }
    static std::vector<std::int64_t> deathsOf(const CrashJournal& journal, const store::Shape& shape) {
        const store::Deaths deaths = journal.deaths(shape);
        return {deaths.crashes, deaths.stops};
    }

    std::string content() const {
        std::ifstream file(path);
        return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    }

    std::string path = ::testing::TempDir() + "shapedb-journal-" + std::to_string(::getpid());
    std::shared_ptr<testing::RecordingLogger> log = std::make_shared<testing::RecordingLogger>();
};

using Counts = std::vector<std::int64_t>;

TEST_F(Journal, TellsCrashesFromKills) {
    CrashJournal first(path, {}, log);
    EXPECT_EQ(deathsOf(first, shape(1)), Counts({0, 0}));
    const CrashJournal::Entry one(first, shape(1));
    const CrashJournal::Entry three(first, shape(3));
    { CrashJournal::Entry two(first, shape(2)); }
    const auto second = afterCrash({{1, 1}, {2, 1}, {3, 7}});
    EXPECT_EQ(deathsOf(*second, shape(1)), Counts({1, 0}));
    EXPECT_EQ(deathsOf(*second, shape(2)), Counts({0, 0})) << "it was put down before";
    EXPECT_EQ(deathsOf(*second, shape(3)), Counts({0, 1})) << "other points crashed";
    EXPECT_EQ(deathsOf(*second, shape(1, 2)), Counts({0, 0})) << "other points";
    const CrashJournal::Entry again(*second, shape(1));
    EXPECT_EQ(deathsOf(*afterCrash({{1, 1}}), shape(1)), Counts({2, 0}));
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(1)), Counts({1, 1})) << "killed";
}

TEST_F(Journal, OnlyAcquittalEndsSuspicion) {
    std::ofstream(path) << "shapedb rebuild journal 2\n1 1 0 0 1\n2 1 1 0 0\n";
    CrashJournal journal(path, {{1, 1}}, log);
    EXPECT_EQ(deathsOf(journal, shape(1)), Counts({1, 0}));
    EXPECT_EQ(deathsOf(journal, shape(2)), Counts({1, 0}));
    { const CrashJournal::Entry interrupted(journal, shape(1)); }
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(1)), Counts({1, 0}));
    {
        CrashJournal::Entry done(journal, shape(1));
        done.acquit();
    }
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(1)), Counts({0, 0}));
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(2)), Counts({1, 0}));
    journal.clear();
    EXPECT_EQ(content(), "shapedb rebuild journal 2\n");
}

TEST_F(Journal, DamagedLinesMakeNoSuspects) {
    std::ofstream(path) << "shapedb rebuild journal 2\n1 1 1 0 0\nnonsense 9 9\n2 1 9 0 0\n";
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(1)), Counts({1, 0}));
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(2)), Counts({0, 0}));
    std::ofstream(path) << "1 1 1 1\n";
    EXPECT_EQ(deathsOf(*afterCrash({}), shape(1)), Counts({0, 0})) << "another format";
}

TEST_F(Journal, IsPrivate) {
    CrashJournal journal(path, {}, log);
    const CrashJournal::Entry entry(journal, shape(1));
    EXPECT_EQ(std::filesystem::status(path).permissions(),
              std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(Journal, WorksWithoutAFile) {
    CrashJournal memory("", {}, log);
    {
        CrashJournal::Entry entry(memory, shape(1));
        entry.acquit();
    }
    EXPECT_EQ(log->all(), "");
    CrashJournal nowhere("/proc/none/at/all", {}, log);
    { const CrashJournal::Entry entry(nowhere, shape(1)); }
    EXPECT_NE(log->all().find("cannot be written"), std::string::npos);
}

}  // namespace
}  // namespace shapedb::ingest
