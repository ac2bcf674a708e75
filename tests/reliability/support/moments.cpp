// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/moments.h"

#include <filesystem>
#include <new>
#include <numeric>

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <zstd.h>

#include "tests/reliability/support/files.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::reliability {

namespace {

namespace fs = std::filesystem;

void putFiles(const Image& files, const std::string& folder) {
    for (const auto& [name, bytes] : files) writeFile(folder + "/" + name, bytes);
}

Image takeFiles(const std::string& folder) {
    Image files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name != "shapes.db-shm" && name != "shapes.db.lock")
            files[name] = readFile(entry.path().string());
    }
    return files;
}

/// One repetition of a moment in a folder of its own.
class Attempt {
  public:
    Attempt(const Moment& moment, const Trouble& trouble)
        : moment_(moment), trouble_(trouble), memoryBefore_(sqlite3_memory_used()) {
        putFiles(moment.files, folder_.path());
        if (trouble.losesSyncs) disk_ = std::make_unique<Disk>(folder_.path());
        world_.clock = moment.clock;
        if (!moment.isOpen) return;
        const auto opened = world_.open();
        if (!opened) ADD_FAILURE() << "before the trouble: " << opened.error().message;
        world_.memory = moment.memory;
    }

    /// Runs the step with trouble at the place.
    Result<void> run(std::uint64_t at) {
        world_.memory = moment_.memory;
        trouble_.arm(at);
        Result<void> done;
        try {
            done = moment_.step.run(world_);
        } catch (const std::exception& escaped) {
            ADD_FAILURE() << "an exception left the store: " << escaped.what();
        }
        trouble_.disarm();
        return done;
    }

    void judge(const Result<void>& done, Tally& tally) {
        ++(done ? tally.unnoticed : tally.errors);
        if (!done) {
            EXPECT_TRUE(trouble_.fits(done.error().code))
                << errorCodeName(done.error().code) << ": " << done.error().message;
            if (world_.store != nullptr) expectDump(moment_.before, "after the error");
            world_.memory = moment_.memory;
            const auto again = moment_.step.run(world_);
            ASSERT_TRUE(again) << "with the trouble gone: " << errorCodeName(again.error().code) << ": "
                               << again.error().message << "\nthe first error: " << done.error().message;
        }
        expectDump(moment_.after, "at the end");
        const auto problems = world_.store->check({});
        ASSERT_TRUE(problems) << problems.error().message;
        for (const std::string& problem : *problems) ADD_FAILURE() << problem;
        const auto written = world_.store->checkpoint();
        EXPECT_TRUE(written) << "something still reads: " << written.error().message;
        expectRestart();
    }

  private:
    void expectDump(const std::string& expected, const char* when) {
        const std::string found = dumpDatabase(world_.path());
        EXPECT_TRUE(found == expected) << when << ":\n" << differenceOf(found, expected);
    }

    void expectRestart() {
        if (disk_ != nullptr) expectSurvivesPowerLoss();
        const auto opened = world_.open();
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_TRUE(world_.store->findings().empty()) << world_.store->findings().front();
        expectDump(moment_.after, "after a restart");
        world_.store.reset();
        EXPECT_EQ(sqlite3_memory_used(), memoryBefore_) << "SQLite keeps memory";
    }

    void expectSurvivesPowerLoss() {
        Random random(1);
        const Image image = disk_->afterPowerLoss(Loss::kAllUnsynced, random);
        disk_.reset();
        const testing::TemporaryDirectory folder;
        putFiles(image, folder.path());
        World after(folder.path());
        const auto opened = after.open();
        ASSERT_TRUE(opened) << opened.error().message;
        const std::string found = dumpDatabase(after.path());
        EXPECT_TRUE(found == moment_.after) << "after a loss of power:\n"
                                            << differenceOf(found, moment_.after);
    }

    const Moment& moment_;
    const Trouble& trouble_;
    const std::int64_t memoryBefore_;
    const testing::TemporaryDirectory folder_;
    std::unique_ptr<Disk> disk_;
    World world_{folder_.path()};
};

}  // namespace

std::vector<Moment> record(const std::vector<Step>& steps, const Image& files) {
    const testing::TemporaryDirectory folder;
    putFiles(files, folder.path());
    World world(folder.path());
    std::vector<Moment> moments;
    std::string dump;
    for (const Step& step : steps) {
        ++world.clock;
        Moment moment{step, world.clock, world.memory, world.store != nullptr, takeFiles(folder.path()),
                      dump, {}};
        const auto done = step.run(world);
        if (!done) {
            ADD_FAILURE() << step.name << ": " << done.error().message;
            break;
        }
        dump = dumpDatabase(world.path());
        moment.after = dump;
        moments.push_back(std::move(moment));
    }
    return moments;
}

Image filesAfter(const std::vector<Step>& steps) {
    const testing::TemporaryDirectory folder;
    {
        World world(folder.path());
        for (const Step& step : steps) {
            const auto done = step.run(world);
            if (!done) ADD_FAILURE() << step.name << ": " << done.error().message;
        }
    }
    return takeFiles(folder.path());
}

std::vector<Moment> recordWholeScript() {
    std::vector<Step> steps = {{"create", [](World& world) { return world.open(); }}};
    for (Step& step : storeScript(0)) steps.push_back(std::move(step));
    steps.push_back({"open", [](World& world) { return world.open(); }});
    return record(steps, {});
}

std::vector<Moment> recordMigrations() {
    std::vector<Moment> moments;
    for (const auto& entry : fs::directory_iterator(SHAPEDB_GOLDEN_DIR)) {
        if (entry.path().filename().string().rfind("database_", 0) != 0) continue;  // of API keys
        const std::string packed = readFile(entry.path().string());
        std::string bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()), '\0');
        ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
        // SQLite's header: without a log, as a server that ends cleanly leaves a file.
        bytes[18] = bytes[19] = 1;
        const std::string name = "migrate " + entry.path().filename().string();
        for (Moment& moment :
             record({{name, [](World& world) { return world.open(); }}}, {{"shapes.db", bytes}}))
            moments.push_back(std::move(moment));
    }
    return moments;
}

Places chosenPlaces(std::uint64_t every, const std::vector<Moment>& moments, const Trouble& trouble,
                    const std::function<void()>& begin,
                    const std::function<std::vector<std::uint64_t>()>& choose) {
    Places places;
    std::uint64_t passed = 0;
    for (const Moment& moment : moments) {
        Attempt attempt(moment, trouble);
        begin();
        const auto done = attempt.run(~std::uint64_t{0});
        if (!done) ADD_FAILURE() << moment.step.name << " without trouble: " << done.error().message;
        places.all += trouble.places();
        std::vector<std::uint64_t>& tried = places.tried.emplace_back();
        for (const std::uint64_t at : choose())
            if (passed++ % every == 0) tried.push_back(at);
    }
    return places;
}

Places everyPlace(std::uint64_t every, const std::vector<Moment>& moments, const Trouble& trouble) {
    const auto all = [&] {
        std::vector<std::uint64_t> places(trouble.places());
        std::iota(places.begin(), places.end(), std::uint64_t{1});
        return places;
    };
    return chosenPlaces(
        every, moments, trouble, [] {}, all);
}

void tryTrouble(const std::vector<Moment>& moments, const Places& places, const Trouble& trouble,
                Tally& tally) {
    for (std::size_t i = 0; i < moments.size(); ++i) {
        for (const std::uint64_t at : places.tried[i]) {
            SCOPED_TRACE(moments[i].step.name + ", " + trouble.name + " at place " + std::to_string(at));
            Attempt attempt(moments[i], trouble);
            const auto done = attempt.run(at);
            ++tally.tried;
            EXPECT_TRUE(trouble.fired()) << "the step takes another way each time";
            attempt.judge(done, tally);
            if (::testing::Test::HasFailure()) return;
        }
    }
}

}  // namespace shapedb::reliability
