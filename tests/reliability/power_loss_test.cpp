// SPDX-License-Identifier: GPL-3.0-or-later
// Loss of power at any moment: what was acknowledged is there after the next start, and no half of anything
// else.
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/reliability/support/disk.h"
#include "tests/reliability/support/faults.h"
#include "tests/reliability/support/files.h"
#include "tests/reliability/support/script.h"
#include "tests/support/scale.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::reliability {
namespace {

namespace fs = std::filesystem;

// In CI power fails at one of so many changes and syncs; SHAPEDB_TEST_SCALE divides it, and beyond makes
// rounds.
constexpr int kEvery = 20;

class PowerLossTest : public ::testing::Test {
  protected:
    PowerLossTest() {
        disk_.before = [this] {
            if (++changes_ % every_ == 0) capture();
        };
    }

    void capture() {
        images_.push_back(disk_.afterPowerLoss(Loss::kAllUnsynced, random_));
        images_.push_back(disk_.afterPowerLoss(Loss::kRandom, random_));
    }

    /// Runs a step; power fails at some points inside it and after it.
    void run(const Step& step) {
        SCOPED_TRACE(step.name);
        const std::string before = dump_;
        ++world_.clock;
        images_.clear();
        const auto done = step.run(world_);
        ASSERT_TRUE(done) << done.error().message;
        dump_ = dumpDatabase(world_.path());
        const std::size_t inside = images_.size();
        for (std::size_t i = 0; i < inside && !HasFailure(); ++i) start(images_[i], {before, dump_});
        if (!world_.memory.lastBackup.empty() && backups_.count(world_.memory.lastBackup) == 0)
            backups_[world_.memory.lastBackup] = dump_;
        if (++steps_ % every_ != 0) return;
        images_.clear();
        capture();
        for (const Image& image : images_) start(image, {dump_});
    }

    /// Starts a store on what a loss of power left: it must hold one of these states, be sound and work.
    void start(const Image& image, const std::vector<std::string>& states) {
        ++starts_;
        const testing::TemporaryDirectory folder;
        for (const auto& [name, bytes] : image) writeFile(folder.file(name), bytes);
        // The shared memory of the log's index may be left, too, with anything in it.
        if (starts_ % 3 == 0) writeFile(folder.file("shapes.db-shm"), std::string(32768, 'x'));
        expectBackups(folder.path(), states.back());
        World after(folder.path());
        after.clock = world_.clock;
        const auto opened = after.open();
        ASSERT_TRUE(opened) << opened.error().message;
        const auto problems = after.store->check({});
        ASSERT_TRUE(problems) << problems.error().message;
        for (const std::string& problem : *problems) ADD_FAILURE() << problem;
        const std::string found = dumpDatabase(after.path());
        EXPECT_NE(std::find(states.begin(), states.end(), found), states.end())
            << (states.size() == 1 ? "after the step:\n" : "inside the step:\n")
            << differenceOf(found, states.back()) << "\nor " << differenceOf(found, states.front());
        EXPECT_TRUE(after.store->createCollection("after the loss", "", ""));
    }

    /// Acknowledged backups are there, and what has the name of a backup is a whole one.
    void expectBackups(const std::string& folder, const std::string& unacknowledged) {
        for (const auto& [name, dump] : backups_)
            EXPECT_TRUE(fs::exists(folder + "/" + name)) << name << " is gone";
        for (const auto& entry : fs::directory_iterator(folder)) {
            const std::string name = entry.path().filename().string();
            if (name.rfind("backup-", 0) != 0 || name.find(".partial") != std::string::npos) continue;
            const auto known = backups_.find(name);
            const std::string& expected = known != backups_.end() ? known->second : unacknowledged;
            const std::string found = dumpDatabase(entry.path().string());
            EXPECT_TRUE(found == expected) << name << ":\n" << differenceOf(found, expected);
        }
    }

    const testing::TemporaryDirectory folder_;
    const FaultVfs vfs_;
    Disk disk_{folder_.path()};
    World world_{folder_.path()};
    Random random_{71};
    const std::uint64_t every_ = static_cast<std::uint64_t>(std::max(1, kEvery / testing::testScale()));
    std::vector<Image> images_;
    std::string dump_;
    std::map<std::string, std::string> backups_;  ///< what the acknowledged ones hold, by name
    std::uint64_t changes_ = 0;
    std::uint64_t steps_ = 0;
    std::uint64_t starts_ = 0;
};

TEST_F(PowerLossTest, KeepsWhatWasAcknowledgedAndNoHalfOfAnythingElse) {
    run({"open", [](World& world) { return world.open(); }});
    const int rounds = 1 + testing::testScale() / kEvery;
    for (int round = 0; round < rounds; ++round) {
        for (const Step& step : storeScript(round)) {
            run(step);
            if (HasFailure()) return;
        }
    }
    run({"close", [](World& world) -> Result<void> {
             world.store.reset();
             return {};
         }});
    EXPECT_GT(starts_, 30u);
    RecordProperty("starts", static_cast<int>(starts_));
    std::cout << changes_ << " changes and syncs, " << starts_ << " starts after a loss of power\n";
}

}  // namespace
}  // namespace shapedb::reliability
