// SPDX-License-Identifier: GPL-3.0-or-later
// A file whose counters stand at their end: refused as a backup, mended as a database.
#include "server/store/sqlite/sequences.h"

#include <limits>

#include "server/store/sqlite/connection.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class SequencesTest : public StoreTest {
  protected:
    void change(const std::string& path, const std::string& sql) const {
        SqliteConnection connection(path, OpenMode::kReadWrite, 1'000);
        connection.execute(sql);
    }
    static std::string endOf(const std::string& table) {
        return "UPDATE sqlite_sequence SET seq = " +
               std::to_string(std::numeric_limits<std::int64_t>::max()) + " WHERE name = '" + table + "'";
    }
};

TEST_F(SequencesTest, BackupsWhoseCountersAreAtTheirEndAreRefused) {
    const Collection c = collection();
    put(c.id, "a", 1);
    finishAll();
    put(c.id, "b", 2);
    const std::string end = "9223372036854775807";
    const std::vector<std::string> attacks = {
        endOf("shape"),
        endOf("job"),
        "UPDATE sqlite_sequence SET seq = -5 WHERE name = 'shape'",
        "UPDATE shape SET version = " + end + " WHERE key = 'a'",
        "UPDATE collection SET generation = " + end + "; UPDATE signature SET generation = " + end,
        "UPDATE job SET attempts = " + end,
        "UPDATE job SET stops = " + end,
        "UPDATE job SET point_bytes = " + end + "; UPDATE tally SET job_bytes = " + end,
        "UPDATE tally SET commits = " + end,
    };
    for (std::size_t i = 0; i < attacks.size(); ++i) {
        const std::string path = folder_.file("backup-" + std::to_string(i));
        ASSERT_TRUE(store_->backup(path, {}));
        change(path, attacks[i]);
        const auto restored = store_->restore(path, {}, {});
        ASSERT_FALSE(restored) << attacks[i];
        EXPECT_EQ(restored.error().code, ErrorCode::kMalformedFile) << restored.error().message;
        EXPECT_TRUE(store_->getShape(c.id, "a"));
        put(c.id, "after " + std::to_string(i), i + 10);
    }
    expectSound();
}

TEST_F(SequencesTest, BackupsWithKeysThatNobodyCouldUploadAreRefused) {
    const Collection c = collection();
    put(c.id, "a", 1);
    finishAll();
    // A C1 control sequence, a line end, an override of the direction, nothing, and too much.
    const std::vector<std::string> keys = {"char(155) || '2J'", "'a' || char(10)", "'a' || char(8238)", "''",
                                           "printf('%0600d', 1)"};
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const std::string path = folder_.file("keys-" + std::to_string(i));
        ASSERT_TRUE(store_->backup(path, {}));
        change(path, "UPDATE shape SET key = " + keys[i]);
        const auto restored = store_->restore(path, {}, {});
        ASSERT_FALSE(restored) << keys[i];
        EXPECT_NE(restored.error().message.find("has a key that is none"), std::string::npos)
            << restored.error().message;
        EXPECT_EQ(restored.error().message.find('\n'), std::string::npos);
    }
}

TEST_F(SequencesTest, ADatabaseThatWasPoisonedBeforeIsMendedAtStart) {
    const Collection c = collection();
    const Shape a = put(c.id, "a", 1);
    const std::string good = folder_.file("good");
    ASSERT_TRUE(store_->backup(good, {}));
    store_.reset();
    for (const char* table : {"collection", "shape", "job"}) change(options().path, endOf(table));
    open();
    EXPECT_EQ(store_->findings().size(), 3u);
    EXPECT_EQ(put(c.id, "b", 2).id, a.id + 1);
    EXPECT_EQ(store_->check({})->size(), 3u) << "told until the next start";
    open();
    expectSound();

    ASSERT_TRUE(store_->restore(good, {}, {}));
    put(c.id, "c", 3);
    finishAll();
    expectSound();
}

}  // namespace
}  // namespace shapedb::store
