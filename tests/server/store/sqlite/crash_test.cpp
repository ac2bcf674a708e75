// SPDX-License-Identifier: GPL-3.0-or-later
// Whatever was acknowledged survives a killed process; damage of the files is detected.
#include <atomic>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include <sys/wait.h>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class CrashTest : public StoreTest {
  protected:
    std::vector<float> pointsOf(int i) { return cloud(static_cast<std::uint64_t>(i), 50 + 37 * (i % 60)); }

    /// In the child: stores shapes 0, 1, 2 ... and writes each number to the pipe after the
    /// store has acknowledged it, until killed. Every third is finished too.
    [[noreturn]] void writeForever(int pipe) {
        auto opened = openSqliteStore(options());
        if (!opened) _exit(1);
        Store& store = **opened;
        const std::int64_t id = store.getCollection("parts")->id;
        for (int i = 0;; ++i) {
            const auto points = pointsOf(i);
            if (!store.putShape(request(id, "k" + std::to_string(i), points, {{"n", std::to_string(i)}})))
                _exit(2);
            if (write(pipe, &i, sizeof i) != sizeof i) _exit(3);
            if (i % 3 == 0) {
                const auto job = store.claimJob();
                if (job && *job) static_cast<void>(store.finishJob(**job, signatureFor(**job)));
            }
        }
    }
};

TEST_F(CrashTest, KillDuringWritesKeepsEverythingAcknowledged) {
    collection();
    Random random(23);
    for (int round = 0; round < 6; ++round) {
        ASSERT_TRUE(store_->deleteCollection(store_->getCollection("parts")->id));
        const std::int64_t id = collection().id;
        store_.reset();
        int ends[2];
        ASSERT_EQ(pipe(ends), 0);
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            close(ends[0]);
            writeForever(ends[1]);
        }
        close(ends[1]);
        int last = -1;
        int number = 0;
        // Killed at a random time after the first acknowledgement.
        ASSERT_EQ(read(ends[0], &number, sizeof number), static_cast<ssize_t>(sizeof number));
        last = number;
        std::this_thread::sleep_for(std::chrono::milliseconds(20 + random.below(180)));
        kill(child, SIGKILL);
        while (read(ends[0], &number, sizeof number) == static_cast<ssize_t>(sizeof number)) last = number;
        close(ends[0]);
        int status = 0;
        ASSERT_EQ(waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself: " << WEXITSTATUS(status);

        open();
        ASSERT_TRUE(store_->recoverJobs(2, {}));
        for (int i = 0; i <= last; ++i) {
            const auto shape = store_->getShape(id, "k" + std::to_string(i));
            ASSERT_TRUE(shape) << i << " of " << last << ": " << shape.error().message;
            EXPECT_EQ(shape->metadata.at("n"), std::to_string(i));
            EXPECT_EQ(store_->loadPoints(shape->id)->xyz, pointsOf(i));
        }
        const std::uint64_t count = store_->countShapes(id, {}).value();
        EXPECT_LE(count, static_cast<std::uint64_t>(last) + 2) << "at most the one being acknowledged";
        expectSound();
        finishAll();
    }
}

/// Opens a damaged database and uses all of it: gets errors or correct answers.
class DamageTest : public StoreTest {
  protected:
    void SetUp() override {
        StoreTest::SetUp();
        const Collection c = collection();
        for (int i = 0; i < 30; ++i) {
            const auto points = cloud(static_cast<std::uint64_t>(i), 400);
            ASSERT_TRUE(store_->putShape(request(c.id, "k" + std::to_string(i), points, {{"n", "v"}})));
        }
        for (int i = 0; i < 20; ++i) {
            const Job job = claim();
            ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
        }
        id_ = c.id;
        store_.reset();
        whole_ = slurp(options().path);
        for (int i = 0; i < 30; ++i) checksums_[checksumOf(cloud(static_cast<std::uint64_t>(i), 400))] = i;
    }

    void use(const std::string& bytes) {
        SqliteOptions damaged = options();
        damaged.path = folder_.file("damaged.db");
        for (const char* ending : {"", "-wal", "-shm"}) std::filesystem::remove(damaged.path + ending);
        spill(damaged.path, bytes);
        auto opened = openSqliteStore(damaged);
        if (!opened) {
            ++refused_;
            return;
        }
        Store& store = **opened;
        for (std::int64_t shapeId = 1; shapeId <= 30; ++shapeId) {
            const auto points = store.loadPoints(shapeId);
            if (!points) continue;
            ++loaded_;
            EXPECT_EQ(checksums_.count(checksumOf(points->xyz)), 1u) << "silently wrong points";
            const auto signature = store.getSignature(shapeId);
            EXPECT_TRUE(!signature || signature->bytes.rfind("signature of ", 0) == 0);
        }
        static_cast<void>(store.listShapes(id_, 0, 100, {}));
        static_cast<void>(store.loadIndex(id_, 0, 100));
        static_cast<void>(store.stats());
        const auto problems = store.check({});
        if (problems && !problems->empty()) ++found_;
        const auto points = cloud(77, 100);
        static_cast<void>(store.putShape(request(id_, "new", points)));
        const auto job = store.claimJob();
        if (job && *job) static_cast<void>(store.finishJob(**job, signatureFor(**job)));
        static_cast<void>(store.deleteShape(id_, "k3", {}));
        static_cast<void>(store.recoverJobs(1, {}));
    }

    std::int64_t id_ = 0;
    std::string whole_;
    std::map<Checksum, int> checksums_;
    int refused_ = 0;
    int found_ = 0;
    int loaded_ = 0;
};

TEST_F(DamageTest, SurvivesFlippedBytes) {
    Random random(31);
    for (int round = 0; round < 40; ++round) {
        std::string bytes = whole_;
        const std::uint64_t flips = 1 + random.below(12);
        for (std::uint64_t i = 0; i < flips; ++i) {
            bytes[random.below(bytes.size())] ^= static_cast<char>(1 + random.below(255));
        }
        use(bytes);
    }
    EXPECT_GT(found_, 10);
    EXPECT_GT(loaded_, 100);
}

TEST_F(DamageTest, SurvivesOverwrittenPages) {
    Random random(37);
    for (int round = 0; round < 40; ++round) {
        std::string bytes = whole_;
        const std::size_t pages = bytes.size() / 4096;
        const std::size_t page = random.below(pages);
        const std::size_t other = random.below(pages);
        if (round % 2 == 0) {
            bytes.replace(4096 * page, 4096, 4096, '\0');
        } else {
            bytes.replace(4096 * page, 4096, whole_, 4096 * other, 4096);
        }
        use(bytes);
    }
    EXPECT_GT(found_ + refused_, 20);
}

TEST_F(DamageTest, SurvivesTruncation) {
    Random random(41);
    for (int round = 0; round < 40; ++round) {
        const int before = found_ + refused_;
        use(whole_.substr(0, round == 0 ? 0 : random.below(whole_.size() - 4096)));
        EXPECT_GT(found_ + refused_, before) << "a truncated file is detected";
    }
}

using ConcurrencyTest = StoreTest;

// Readers beside writers see points, metadata and checksum of the same state.
TEST_F(ConcurrencyTest, ReadersSeeConsistentStatesBesideWriters) {
    const Collection c = collection();
    std::atomic<bool> stop{false};
    std::atomic<int> bad{0};
    std::atomic<int> seen{0};
    std::vector<std::thread> readers;
    for (int t = 0; t < 3; ++t) {
        readers.emplace_back([&] {
            while (!stop) {
                const auto shapes = store_->listShapes(c.id, 0, 100, {});
                if (!shapes) {
                    ++bad;
                    continue;
                }
                for (const Shape& shape : *shapes) {
                    const auto seed = std::stoull(shape.metadata.at("seed"));
                    if (shape.checksum != checksumOf(cloud(seed))) ++bad;
                    const auto points = store_->loadPoints(shape.id);
                    if (!points && points.error().code != ErrorCode::kNotFound) ++bad;
                    ++seen;
                }
                if (!store_->loadIndex(c.id, 0, 100) || !store_->queueDepth()) ++bad;
            }
        });
    }
    std::vector<std::thread> writers;
    for (std::uint64_t t = 0; t < 2; ++t) {
        writers.emplace_back([&, t] {
            Random random(t);
            for (int i = 0; i < 80; ++i) {
                const std::uint64_t seed = random.below(1000);
                const auto points = cloud(seed);
                const std::string key = "k" + std::to_string(random.below(10));
                if (!store_->putShape(request(c.id, key, points, {{"seed", std::to_string(seed)}}))) ++bad;
                if (i % 5 == 0) static_cast<void>(store_->deleteShape(c.id, key, {}));
                const auto job = store_->claimJob();
                if (!job) ++bad;
                if (job && *job && !store_->finishJob(**job, signatureFor(**job))) ++bad;
            }
        });
    }
    for (auto& writer : writers) writer.join();
    stop = true;
    for (auto& reader : readers) reader.join();
    EXPECT_EQ(bad, 0);
    EXPECT_GT(seen, 0);
    expectSound();
}

// Two workers never get the same job.
TEST_F(ConcurrencyTest, EachJobIsClaimedOnce) {
    const Collection c = collection();
    for (int i = 0; i < 60; ++i) put(c.id, "k" + std::to_string(i), static_cast<std::uint64_t>(i));
    std::atomic<int> finished{0};
    std::vector<std::thread> workers;
    for (int t = 0; t < 4; ++t) {
        workers.emplace_back([&] {
            while (true) {
                const auto job = store_->claimJob();
                if (!job || !*job) return;
                const auto done = store_->finishJob(**job, signatureFor(**job));
                if (done && *done) ++finished;
            }
        });
    }
    for (auto& worker : workers) worker.join();
    EXPECT_EQ(finished, 60);
    EXPECT_EQ(store_->stats()->shapesReady, 60u);
    expectSound();
}

}  // namespace
}  // namespace shapedb::store
