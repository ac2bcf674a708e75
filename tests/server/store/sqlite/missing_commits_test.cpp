// SPDX-License-Identifier: GPL-3.0-or-later
// Changes that were acknowledged and are gone are noticed at the next start.
#include <filesystem>

#include "server/store/sqlite/commit_mark.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

namespace fs = std::filesystem;

class MissingCommitsTest : public StoreTest {
  protected:
    std::string wal() const { return options().path + "-wal"; }

    /// The files as a process that is killed now leaves them, put back after this one has ended.
    void dieWith(const std::function<void()>& damage) {
        const std::string database = slurp(options().path);
        const std::string log = slurp(wal());
        const std::string mark = slurp(options().path + ".commits");
        store_.reset();
        spill(options().path, database);
        spill(wal(), log);
        spill(options().path + ".commits", mark);
        fs::remove(options().path + "-shm");
        damage();
        open();
    }

    std::uint64_t missing() { return store_->stats()->missingCommits; }
};

TEST_F(MissingCommitsTest, NoneAfterAKill) {
    const Collection c = collection();
    put(c.id, "a", 1);
    dieWith([] {});
    EXPECT_EQ(missing(), 0u);
    EXPECT_TRUE(store_->findings().empty());
    expectSound();
    open();
    EXPECT_EQ(missing(), 0u) << "nor after a clean end";
}

TEST_F(MissingCommitsTest, AreCountedWhenTheLogWasRemoved) {
    const Collection c = collection();
    ASSERT_TRUE(store_->checkpoint());
    for (int i = 0; i < 3; ++i) put(c.id, std::to_string(i), static_cast<std::uint64_t>(i));
    dieWith([&] { fs::remove(wal()); });
    EXPECT_EQ(missing(), 3u);
    ASSERT_EQ(store_->findings().size(), 1u);
    EXPECT_NE(store_->findings()[0].find("last 3 acknowledged changes are missing"), std::string::npos)
        << store_->findings()[0];
    EXPECT_EQ(store_->check({})->size(), 1u) << "check is not clean";
}

TEST_F(MissingCommitsTest, AreCountedWhenAFrameOfTheLogIsDamaged) {
    const Collection c = collection();
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "0", 0);
    const std::uintmax_t whole = fs::file_size(wal());
    put(c.id, "1", 1);
    put(c.id, "2", 2);
    dieWith([&] {
        std::string log = slurp(wal());
        log[static_cast<std::size_t>(whole) + 40] ^= 1;
        spill(wal(), log);
    });
    EXPECT_EQ(missing(), 2u);
    EXPECT_TRUE(store_->getShape(c.id, "0"));
    EXPECT_FALSE(store_->getShape(c.id, "1"));
}

TEST_F(MissingCommitsTest, AreOverAfterARestore) {
    const Collection c = collection();
    put(c.id, "a", 1);
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "b", 2);
    dieWith([&] { fs::remove(wal()); });
    ASSERT_EQ(missing(), 1u);
    ASSERT_TRUE(store_->restore(backup, {}, {}));
    EXPECT_EQ(missing(), 0u);
    expectSound();
    open();
    EXPECT_EQ(missing(), 0u) << "the backup's count is older than the mark";
}

TEST_F(MissingCommitsTest, AreToldAtEveryStartUntilTheyAreAcknowledged) {
    const Collection c = collection();
    ASSERT_TRUE(store_->checkpoint());
    for (int i = 0; i < 3; ++i) put(c.id, std::to_string(i), static_cast<std::uint64_t>(i));
    dieWith([&] { fs::remove(wal()); });
    const auto told = store_->findings();
    for (int start = 0; start < 3; ++start) {
        EXPECT_EQ(missing(), 3u) << start;
        EXPECT_EQ(store_->notices(), 1u);
        EXPECT_EQ(store_->findings(), told);
        put(c.id, "later " + std::to_string(start), 9);
        open();
    }
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "once more", 10);
    dieWith([&] { fs::remove(wal()); });
    EXPECT_EQ(missing(), 4u);
    EXPECT_EQ(store_->notices(), 2u);
    EXPECT_NE(store_->findings()[0].find("'shapedb admin check --acknowledge'"), std::string::npos);

    EXPECT_EQ(store_->acknowledge()->size(), 2u);
    EXPECT_EQ(missing(), 0u);
    EXPECT_EQ(store_->notices(), 0u);
    expectSound();
    open();
    EXPECT_EQ(missing(), 0u);
    EXPECT_TRUE(store_->findings().empty());
}

TEST_F(MissingCommitsTest, AMarkThatIsGoneIsTold) {
    const Collection c = collection();
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "a", 1);
    const std::string mark = options().path + ".commits";
    for (const bool emptied : {true, false}) {
        dieWith([&] {
            fs::remove(wal());
            emptied ? spill(mark, "") : static_cast<void>(fs::remove(mark));
        });
        EXPECT_EQ(missing(), 0u) << "nobody can tell";
        ASSERT_EQ(store_->findings().size(), 1u);
        EXPECT_NE(store_->findings()[0].find(mark), std::string::npos) << store_->findings()[0];
        open();
        EXPECT_EQ(store_->notices(), 1u) << "still";
        EXPECT_EQ(store_->check({})->size(), 1u);
        ASSERT_TRUE(store_->acknowledge());
        expectSound();
        ASSERT_TRUE(store_->checkpoint()) << "not in the log that is lost next";
    }
}

TEST_F(MissingCommitsTest, AFirstRunThatLostItsLogAndItsMarkIsTold) {
    // Nothing was written back yet: the file has no commit, and would pass for a new one.
    const Collection c = collection();
    put(c.id, "a", 1);
    for (const bool lockToo : {false, true}) {
        dieWith([&] {
            fs::remove(wal());
            fs::remove(options().path + ".commits");
            if (lockToo) fs::remove(options().path + ".lock");
        });
        ASSERT_EQ(store_->findings().size(), 1u) << lockToo;
        EXPECT_NE(store_->findings()[0].find("the last server did not close the database"), std::string::npos)
            << store_->findings()[0];
        EXPECT_EQ(store_->notices(), 1u);
        EXPECT_EQ(store_->check({})->size(), 1u);
        ASSERT_TRUE(store_->acknowledge());
        expectSound();
    }
}

TEST_F(MissingCommitsTest, ACopyOfTheFileAloneIsToldIfAServerHadItOpen) {
    const Collection c = collection();
    put(c.id, "a", 1);
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "b", 2);
    const std::string inUse = slurp(options().path);
    store_.reset();
    const std::string closed = slurp(options().path);
    EXPECT_FALSE(fs::exists(wal()));
    for (const bool wasClosed : {true, false}) {
        const Folder fresh;
        SqliteOptions there = options();
        there.path = fresh.file("shapes.db");
        spill(there.path, wasClosed ? closed : inUse);
        for (int start = 0; start < 2; ++start) {
            const auto opened = openSqliteStore(there);
            ASSERT_TRUE(opened) << opened.error().message;
            EXPECT_EQ((*opened)->findings().size(), wasClosed ? 0u : 1u);
            EXPECT_EQ((*opened)->getShape(c.id, "b").has_value(), wasClosed);
        }
    }
}

TEST_F(MissingCommitsTest, NoneAfterDeathsAtTheFirstStart) {
    // As a process leaves it that dies once the file says that it is open: the mark is there.
    const Folder fresh;
    SqliteOptions there = options();
    there.path = fresh.file("shapes.db");
    std::string file;
    std::string mark;
    {
        const auto opened = openSqliteStore(there);
        ASSERT_TRUE(opened);
        file = slurp(there.path);
        mark = slurp(there.path + ".commits");
    }
    for (const std::string end : {"-wal", "-shm", ".lock", ".reserve"}) fs::remove(there.path + end);
    spill(there.path, file);
    spill(there.path + ".commits", mark);
    const auto opened = openSqliteStore(there);
    ASSERT_TRUE(opened);
    EXPECT_TRUE((*opened)->findings().empty());
}

TEST_F(MissingCommitsTest, ABackupInANewFolderHasNoMarkAndLacksNothing) {
    const Collection c = collection();
    put(c.id, "a", 1);
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    const Folder fresh;
    SqliteOptions there = options();
    there.path = fresh.file("shapes.db");
    spill(there.path, slurp(backup));
    for (int start = 0; start < 2; ++start) {
        const auto opened = openSqliteStore(there);
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_TRUE((*opened)->findings().empty());
    }
}

TEST_F(MissingCommitsTest, NoticesAreNotRestored) {
    const Collection c = collection();
    ASSERT_TRUE(store_->checkpoint());
    put(c.id, "a", 1);
    dieWith([&] { fs::remove(wal()); });
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    ASSERT_TRUE(store_->restore(backup, {}, {}));
    EXPECT_EQ(store_->notices(), 0u);
    open();
    EXPECT_TRUE(store_->findings().empty());
}

TEST_F(MissingCommitsTest, RequestsThatChangeNothingAreNotCounted) {
    const Collection c = collection();
    put(c.id, "a", 1);
    const CommitMark mark(options().path + ".commits");
    const auto before = mark.read();
    ASSERT_TRUE(before);
    put(c.id, "a", 1);
    ASSERT_TRUE(store_->recoverJobs(2, {}));
    EXPECT_EQ(mark.read(), before);
}

TEST(CommitMark, RefusesDamageAndLinks) {
    const testing::TemporaryDirectory folder;
    const std::string path = folder.file("mark");
    {
        const CommitMark mark(path);
        EXPECT_FALSE(mark.read());
        mark.write(123);
        EXPECT_EQ(mark.read(), 123);
        mark.write(7);
    }
    EXPECT_EQ(CommitMark(path).read(), 7);
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    const std::string good = slurp(path);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = 'x';
        spill(path, bad);
        EXPECT_FALSE(CommitMark(path).read()) << i;
    }
    spill(path, good + "x");
    EXPECT_FALSE(CommitMark(path).read());
    fs::create_symlink(path, folder.file("link"));
    EXPECT_FALSE(CommitMark(folder.file("link")).read());
}

}  // namespace
}  // namespace shapedb::store
