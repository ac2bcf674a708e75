// SPDX-License-Identifier: GPL-3.0-or-later
// Backups, restores and what happens beside them. A backup is a database in a file, whatever it was made
// from.
#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class BackupTest : public EachStoreTest {
  protected:
    void SetUp() override {
        EachStoreTest::SetUp();
        if (IsSkipped()) return;
        collection_ = collection();
        for (int i = 0; i < 6; ++i) put(collection_.id, "k" + std::to_string(i), 10 + i, {{"label", "cup"}});
        for (int i = 0; i < 4; ++i) {
            const Job job = claim();
            ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
        }
        ASSERT_TRUE(store_->backup(backup_, {}));
    }

    Collection collection_;
    std::string backup_ = folder_.file("backup.db");
};

TEST_P(BackupTest, RestoreReproducesTheContent) {
    const auto before = store_->listShapes(collection_.id, 0, 100, {}).value();
    const auto index = store_->loadIndex(collection_.id, 0, 100).value();
    const std::string file = slurp(backup_);
    put(collection_.id, "k0", 77);
    put(collection_.id, "later", 78);
    ASSERT_TRUE(store_->deleteShape(collection_.id, "k1", {}));
    collection("later");
    std::string stages;
    RunContext context;
    context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
        if (stages.find(stage) == std::string::npos) stages += std::string(stage) + " ";
    };
    const auto restored = store_->restore(backup_, context, {});
    ASSERT_TRUE(restored) << restored.error().message;
    EXPECT_NE(stages.find("copy integrity points"), std::string::npos) << stages;
    EXPECT_TRUE(slurp(backup_) == file) << "the backup is left as it is";
    for (int round = 0; round < 2; ++round) {
        const auto after = store_->listShapes(collection_.id, 0, 100, {}).value();
        ASSERT_EQ(after.size(), before.size());
        for (std::size_t i = 0; i < after.size(); ++i) EXPECT_TRUE(after[i] == before[i]);
        EXPECT_EQ(store_->loadIndex(collection_.id, 0, 100)->size(), index.size());
        EXPECT_EQ(store_->listCollections()->size(), 1u);
        EXPECT_EQ(store_->loadPoints(before[0].id)->xyz, cloud(10));
        EXPECT_EQ(store_->queueDepth()->jobs, 2u);
        open();
    }
    finishAll();
    expectSound();
}

TEST_P(BackupTest, DropsResultsInFlightAcrossARestore) {
    // Same history: without care the ids of "later" would be given out again.
    const Shape later = put(collection_.id, "later", 50);
    finishAll();
    put(collection_.id, "later", 51);
    const Job inFlight = claim();
    const Rebuild rebuild = store_->startRebuild(collection_.id, "finer").value();
    ASSERT_TRUE(store_->restore(backup_, {}, {}));
    const Shape fresh = put(collection_.id, "fresh", 52);
    EXPECT_GT(fresh.id, later.id);
    EXPECT_FALSE(store_->finishJob(inFlight, signatureFor(inFlight)).value());
    EXPECT_FAILS(store_->putRebuilt(rebuild.id, signatureFor(fresh.id, 1, 2)), ErrorCode::kNotFound);
    EXPECT_GT(store_->startRebuild(collection_.id, "finer")->id, rebuild.id);
    std::int64_t last = inFlight.id;
    for (int i = 0; i < 3; ++i) {
        const Job job = claim();
        EXPECT_GT(job.id, last);
        last = job.id;
    }
    expectSound();
}

TEST_P(BackupTest, RunningJobsComeBackQueuedAndUntried) {
    claim();
    const std::string path = folder_.file("second.db");
    ASSERT_TRUE(store_->backup(path, {}));
    ASSERT_TRUE(store_->restore(path, {}, {}));
    EXPECT_EQ(claim().attempts, 1);
    EXPECT_EQ(claim().attempts, 1);
}

TEST_P(BackupTest, CancelledBackupLeavesNothing) {
    // Enough pages for several steps.
    for (int i = 0; i < 8; ++i) {
        const auto big = cloud(200 + i, 20000);
        ASSERT_TRUE(store_->putShape(request(collection_.id, "big" + std::to_string(i), big)));
    }
    const std::string large = folder_.file("large.db");
    ASSERT_TRUE(store_->backup(large, {}));
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    for (const std::string stop : {"copy", "integrity", "points", "restore", "backup"}) {
        cancel = false;
        context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
            if (stage == stop) cancel = true;
        };
        const std::string path = folder_.file("cancelled.db");
        if (stop == "backup") {
            EXPECT_FAILS(store_->backup(path, context), ErrorCode::kCancelled);
            EXPECT_FALSE(std::filesystem::exists(path));
        } else {
            put(collection_.id, "live", 98);
            bool replacing = false;
            const auto told = [&] {
                replacing = true;
                return Result<void>();
            };
            EXPECT_FAILS(store_->restore(large, context, told), ErrorCode::kCancelled);
            EXPECT_EQ(replacing, stop == "restore") << stop;
            EXPECT_TRUE(store_->getShape(collection_.id, "live")) << stop;
        }
    }
    cancel = true;
    context.progress = nullptr;
    EXPECT_FAILS(store_->check(context), ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now() - std::chrono::seconds(1);
    EXPECT_FAILS(store_->check(late), ErrorCode::kDeadlineExceeded);
    expectSound();
}

TEST_P(BackupTest, ReadersSeeOldOrNewContent) {
    // Two contents, restored in turn; the label of their shapes tells which.
    const std::string other = folder_.file("other.db");
    for (int i = 0; i < 6; ++i) put(collection_.id, "k" + std::to_string(i), 10 + i, {{"label", "jug"}});
    ASSERT_TRUE(store_->backup(other, {}));
    std::atomic<bool> stop{false};
    std::atomic<int> mixed{0};
    std::atomic<int> reads{0};
    std::vector<std::thread> readers;
    for (int t = 0; t < 2; ++t) {
        readers.emplace_back([&] {
            while (!stop) {
                const auto shapes = store_->listShapes(collection_.id, 0, 100, {});
                bool good = shapes && shapes->size() == 6;
                if (good) {
                    for (const Shape& shape : *shapes)
                        good = good && shape.metadata == shapes->front().metadata;
                }
                if (!good) ++mixed;
                ++reads;
            }
        });
    }
    // At least ten, more until the readers had their turn; the last one restores `other`.
    for (int i = 0; i < 10 || i % 2 != 0 || (reads <= 10 && i < 1'000); ++i) {
        const auto restored = store_->restore(i % 2 ? other : backup_, {}, {});
        EXPECT_TRUE(restored) << restored.error().message;
    }
    stop = true;
    for (auto& reader : readers) reader.join();
    EXPECT_EQ(mixed, 0);
    EXPECT_GT(reads, 10);
    EXPECT_EQ(store_->getShape(collection_.id, "k0")->metadata.at("label"), "jug");
    expectSound();
}

TEST_P(BackupTest, BackupBesideWritesIsConsistent) {
    // A backup has everything that was acknowledged before it started.
    std::atomic<bool> stop{false};
    std::atomic<int> acknowledged{0};
    std::thread writer([&] {
        for (int i = 0; !stop; ++i) {
            const auto points = cloud(1000 + i, 2000);
            if (store_->putShape(request(collection_.id, "w" + std::to_string(i), points)))
                acknowledged = i + 1;
        }
    });
    for (int round = 0; round < 5; ++round) {
        const int least = acknowledged;
        SqliteOptions copied = options();
        copied.path = folder_.file("moment" + std::to_string(round) + ".db");
        const auto made = store_->backup(copied.path, {});
        EXPECT_TRUE(made) << made.error().message;
        auto opened = openSqliteStore(copied);
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_TRUE((*opened)->check({})->empty());
        EXPECT_GE((*opened)->countShapes(collection_.id, {}).value(), static_cast<std::uint64_t>(6 + least));
    }
    stop = true;
    writer.join();
    expectSound();
}

/// Moves the content from one engine to the other, and back.
TEST_P(BackupTest, IsRestoredOnAnotherEngine) {
    const auto before = store_->listShapes(collection_.id, 0, 100, {}).value();
    const auto index = store_->loadIndex(collection_.id, 0, 100).value();
    ASSERT_TRUE(store_->deleteShape(collection_.id, "k5", {}));
    SqliteOptions other = options();
    other.path = folder_.file("other.db");
    auto moved = std::move(openSqliteStore(other).value());
    ASSERT_TRUE(moved->restore(backup_, {}, {}));
    const std::string back = folder_.file("back.db");
    ASSERT_TRUE(moved->backup(back, {}));
    const auto restored = store_->restore(back, {}, {});
    ASSERT_TRUE(restored) << restored.error().message;
    const auto after = store_->listShapes(collection_.id, 0, 100, {}).value();
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
        EXPECT_EQ(after[i], before[i]);
        EXPECT_EQ(store_->loadPoints(after[i].id)->xyz, cloud(10 + i));
    }
    const auto loaded = store_->loadIndex(collection_.id, 0, 100).value();
    ASSERT_EQ(loaded.size(), index.size());
    for (std::size_t i = 0; i < loaded.size(); ++i)
        EXPECT_EQ(loaded[i].signature.bytes, index[i].signature.bytes);
    expectSound();
}

SHAPEDB_ON_EACH_ENGINE(BackupTest);

}  // namespace
}  // namespace shapedb::store
