// SPDX-License-Identifier: GPL-3.0-or-later
// A damaged index is mended by a backup that is made then, which has all that was stored.
#include <atomic>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/migrator.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

constexpr std::size_t kDamagedBytes = 64;

class DamagedIndexTest : public StoreTest {
  protected:
    void SetUp() override {
        StoreTest::SetUp();
        collection_ = collection();
        ASSERT_TRUE(store_->setAlias("pieces", collection_.id));
        for (int i = 0; i < 6; ++i) put(collection_.id, "k" + std::to_string(i), 10 + i, {{"label", "cup"}});
        for (int i = 0; i < 4; ++i) {
            const Job job = claim();
            ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
        }
        ASSERT_TRUE(store_->deleteShape(collection_.id, "k5", {}));
        store_.reset();
        whole_ = slurp(options().path);
    }

    /// Names and first pages; small indices have no others.
    std::vector<std::pair<std::string, std::size_t>> roots(const std::string& kind) const {
        std::vector<std::pair<std::string, std::size_t>> found;
        SqliteConnection connection(options().path, OpenMode::kReadOnly, 0);
        const std::string list = "SELECT name, rootpage FROM sqlite_schema WHERE type = '" + kind + "'";
        Query query(connection, list.c_str());
        while (query.step()) found.emplace_back(query.text(0), static_cast<std::size_t>(query.integer(1)));
        return found;
    }

    /// Opens the database with its first damaged page.
    void openDamaged(std::size_t page) {
        store_.reset();
        std::string bytes = whole_;
        bytes.replace((page - 1) * kPageSize, kDamagedBytes, std::string(kDamagedBytes, '\xff'));
        spill(options().path, bytes);
        open();
    }

    std::size_t indexed() { return store_->loadIndex(collection_.id, 0, 100).value().size(); }

    std::string newPath() { return folder_.file("backup-" + std::to_string(++backups_)); }

    Collection collection_;
    std::string whole_;
    int backups_ = 0;
};

TEST_F(DamagedIndexTest, IsMendedByABackupThatIsMadeAfterwards) {
    open();
    const std::vector<Shape> before = store_->listShapes(collection_.id, 0, 100, {}).value();
    store_.reset();
    const auto indices = roots("index");
    ASSERT_GE(indices.size(), 12u);
    for (const auto& [name, page] : indices) {
        SCOPED_TRACE(name);
        openDamaged(page);
        EXPECT_EQ(indexed(), 4u);
        EXPECT_FALSE(store_->check({}).value().empty());
        const std::string path = newPath();
        const auto made = store_->backup(path, {});
        ASSERT_TRUE(made) << made.error().message;
        const auto restored = store_->restore(path, {}, {});
        ASSERT_TRUE(restored) << restored.error().message;
        expectSound();
        EXPECT_TRUE(store_->findings().empty());
        const std::vector<Shape> after = store_->listShapes(collection_.id, 0, 100, {}).value();
        ASSERT_EQ(after.size(), before.size());
        for (std::size_t i = 0; i < after.size(); ++i) EXPECT_TRUE(after[i] == before[i]);
        EXPECT_EQ(store_->loadPoints(before[0].id)->xyz, cloud(10));
        EXPECT_EQ(indexed(), 4u);
        EXPECT_EQ(store_->listAliases()->size(), 1u);
        EXPECT_EQ(store_->queueDepth()->jobs, 1u);
        EXPECT_GT(put(collection_.id, "later", 30).id, before.back().id + 1) << "ids are not given out twice";
    }
}

TEST_F(DamagedIndexTest, ThatSearchesMeetIsToldWithWhatMendsIt) {
    for (const auto& [name, page] : roots("index")) {
        if (name != "shape_by_collection") continue;
        openDamaged(page);
        EXPECT_TRUE(store_->findings().empty());
        EXPECT_EQ(indexed(), 4u);
        ASSERT_EQ(store_->findings().size(), 1u);
        EXPECT_NE(store_->findings()[0].find("to mend it, make a backup now"), std::string::npos)
            << store_->findings()[0];
        // No check before it.
        const std::string path = newPath();
        ASSERT_TRUE(store_->backup(path, {}));
        ASSERT_TRUE(store_->restore(path, {}, {}));
        expectSound();
        return;
    }
    FAIL() << "there is no such index";
}

TEST_F(DamagedIndexTest, DamagedTablesAreStillBackedUpAsTheyAre) {
    for (const auto& [name, page] : roots("table")) {
        if (name != "shape_points" && name != "shape_metadata") continue;
        SCOPED_TRACE(name);
        openDamaged(page);
        EXPECT_FALSE(store_->check({}).value().empty());
        const std::string path = newPath();
        const auto made = store_->backup(path, {});
        ASSERT_TRUE(made) << made.error().message;
        EXPECT_EQ(slurp(path).size(), whole_.size());
        const auto restored = store_->restore(path, {}, {});
        ASSERT_FALSE(restored);
        EXPECT_EQ(restored.error().code, ErrorCode::kMalformedFile) << restored.error().message;
    }
}

TEST_F(DamagedIndexTest, AnInterruptedCopyLeavesNoFile) {
    openDamaged(roots("index").front().second);
    EXPECT_FALSE(store_->check({}).value().empty());
    const std::string path = newPath();
    std::atomic<bool> cancelled{true};
    RunContext context;
    context.cancel = &cancelled;
    const auto made = store_->backup(path, context);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::kCancelled) << made.error().message;
    EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace shapedb::store
