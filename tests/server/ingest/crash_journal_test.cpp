#include "server/ingest/crash_journal.h"

#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>

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

    /// The journal as the next process reads it if this one dies now.
    std::unique_ptr<CrashJournal> afterDeath() { return std::make_unique<CrashJournal>(path, log); }

    std::string content() const {
        std::ifstream file(path);
        return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    }

    std::string path = ::testing::TempDir() + "shapedb-journal-" + std::to_string(::getpid());
    std::shared_ptr<testing::RecordingLogger> log = std::make_shared<testing::RecordingLogger>();
};

TEST_F(Journal, CountsScansInHandWhenTheProcessDied) {
    CrashJournal first(path, log);
    EXPECT_EQ(first.deaths(shape(1)), 0);
    const CrashJournal::Entry one(first, shape(1));
    { CrashJournal::Entry two(first, shape(2)); }
    const auto second = afterDeath();
    EXPECT_EQ(second->deaths(shape(1)), 1);
    EXPECT_EQ(second->deaths(shape(2)), 0) << "it was put down before";
    EXPECT_EQ(second->deaths(shape(1, 2)), 0) << "other points";
    const CrashJournal::Entry again(*second, shape(1));
    EXPECT_EQ(afterDeath()->deaths(shape(1)), 2);
}

TEST_F(Journal, OnlyAcquittalEndsSuspicion) {
    std::ofstream(path) << "1 1 0 1\n2 1 1 0\n";
    CrashJournal journal(path, log);
    EXPECT_EQ(journal.deaths(shape(1)), 1);
    EXPECT_EQ(journal.deaths(shape(2)), 1);
    { const CrashJournal::Entry interrupted(journal, shape(1)); }
    EXPECT_EQ(afterDeath()->deaths(shape(1)), 1);
    {
        CrashJournal::Entry done(journal, shape(1));
        done.acquit();
    }
    EXPECT_EQ(afterDeath()->deaths(shape(1)), 0);
    EXPECT_EQ(afterDeath()->deaths(shape(2)), 1);
    journal.clear();
    EXPECT_EQ(content(), "");
}

TEST_F(Journal, DamagedLinesMakeNoSuspects) {
    std::ofstream(path) << "1 1 1 0\nnonsense 9 9\n2 1 9 0\n";
    EXPECT_EQ(afterDeath()->deaths(shape(1)), 1);
    EXPECT_EQ(afterDeath()->deaths(shape(2)), 0);
}

TEST_F(Journal, WorksWithoutAFile) {
    CrashJournal memory("", log);
    {
        CrashJournal::Entry entry(memory, shape(1));
        entry.acquit();
    }
    EXPECT_EQ(log->all(), "");
    CrashJournal nowhere("/proc/none/at/all", log);
    { const CrashJournal::Entry entry(nowhere, shape(1)); }
    EXPECT_NE(log->all().find("cannot be written"), std::string::npos);
}

}  // namespace
}  // namespace shapedb::ingest
