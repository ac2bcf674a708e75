// SPDX-License-Identifier: GPL-3.0-or-later
// The process dies between any two steps of what the server does to its files: the next one starts, and
// nothing that was acknowledged is lost.
#include <atomic>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/index/collection_index.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/rebuild_driver.h"
#include "server/ingest/worker_pool.h"
#include "tests/reliability/support/failpoints.h"
#include "tests/reliability/support/files.h"
#include "tests/reliability/support/moments.h"
#include "tests/server/support/fixtures.h"
#include "tests/support/scale.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::reliability {
namespace {

/// Runs `body` in a process of its own; its exit code.
int inChild(const std::function<void()>& body) {
    const pid_t child = ::fork();
    if (child == 0) {
        body();
        std::cout.flush();
        std::fflush(nullptr);
        ::_exit(::testing::Test::HasFailure() ? 1 : 0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Counts what a child says it has done.
class Pipe {
  public:
    Pipe() { EXPECT_EQ(::pipe(ends_), 0); }
    ~Pipe() {
        ::close(ends_[0]);
        if (ends_[1] >= 0) ::close(ends_[1]);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;

    void put() const {
        if (::write(ends_[1], "x", 1) != 1) ::_exit(3);
    }
    /// Once, after the child has ended.
    std::size_t count() {
        ::close(std::exchange(ends_[1], -1));
        std::size_t bytes = 0;
        for (char one = 0; ::read(ends_[0], &one, 1) == 1;) ++bytes;
        return bytes;
    }

  private:
    int ends_[2] = {-1, -1};
};

int deathCount = 0;

/// At most so many times each failpoint is deadly, spread over all times it is reached.
int mostDeaths() { return 3 * testing::testScale(); }

std::vector<int> chosenTimes(int reached) {
    std::vector<int> times;
    const int deaths = std::min(mostDeaths(), reached);
    for (int i = 0; i < deaths; ++i) times.push_back(1 + i * reached / deaths);
    return times;
}

/// Dies once in the steps, and starts again.
void dieIn(const std::vector<Moment>& moments, const Image& files, const std::string& name, int time) {
    SCOPED_TRACE(name + ", reached for the " + std::to_string(time) + ". time");
    const testing::TemporaryDirectory folder;
    for (const auto& [file, bytes] : files) writeFile(folder.file(file), bytes);
    Pipe pipe;
    const int exit = inChild([&] {
        Failpoints::dieAt(name, time);
        World world(folder.path());
        for (const Moment& moment : moments) {
            world.clock = moment.clock;
            if (!moment.step.run(world)) ::_exit(2);
            pipe.put();
        }
    });
    const std::size_t acknowledged = pipe.count();
    ASSERT_EQ(exit, kDiedThere);
    ++deathCount;
    ASSERT_LT(acknowledged, moments.size());

    const Moment& moment = moments[acknowledged];
    World after(folder.path());
    after.clock = moment.clock;
    const auto opened = after.open();
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_TRUE(after.store->findings().empty()) << after.store->findings().front();
    const auto problems = after.store->check({});
    ASSERT_TRUE(problems) << problems.error().message;
    for (const std::string& problem : *problems) ADD_FAILURE() << problem;
    const std::string found = dumpDatabase(after.path());
    EXPECT_TRUE(found == moment.before || found == moment.after)
        << moment.step.name << ":\n"
        << differenceOf(found, moment.after) << "\nor " << differenceOf(found, moment.before);
    EXPECT_TRUE(after.store->createCollection("afterwards", "", ""));
}

/// Dies at every failpoint that the steps reach; returns these.
std::set<std::string> dieEverywhere(const std::function<std::vector<Moment>()>& make, const Image& files) {
    Failpoints::forget();
    const std::vector<Moment> moments = make();
    const std::map<std::string, int> reached = Failpoints::reached();
    std::set<std::string> names;
    for (const auto& [name, count] : reached) {
        names.insert(name);
        for (const int time : chosenTimes(count)) dieIn(moments, files, name, time);
    }
    return names;
}

/// A store with workers and rebuilds on it, as in a server.
class Server {
  public:
    explicit Server(const std::string& folder) : folder_(folder), world_(folder) {
        const auto opened = world_.open();
        if (!opened) ::_exit(4);
        log_ = std::make_shared<testing::RecordingLogger>();
        index_ = std::make_unique<index::CollectionIndex>(*world_.store, log_);
    }

    /// Scans, one of them without an interior, and a rebuild; all ended when it returns. Calls `stored` after
    /// each scan.
    void work(const std::function<void()>& stored) {
        auto made = store().getCollection("parts");
        if (!made) made = store().createCollection("parts", "", testing::paperParameters());
        EXPECT_TRUE(made && index_->loadAll());
        ingest::WorkerPool pool(store(), *index_, board_, isolation_, pipeline(), log_, {});
        ingest::RebuildOptions options;
        options.journalPath = folder_ + "/rebuild.journal";
        ingest::RebuildDriver driver(store(), *index_, pool, isolation_, pipeline(), log_, options);
        EXPECT_TRUE(pool.start());
        EXPECT_TRUE(driver.start());
        for (int i = 0; i < kScans; ++i) {
            EXPECT_TRUE(store().putShape(testing::putRequest(
                made->id, "k" + std::to_string(i), testing::taggedPoints(i == 2 ? -1.0f : 1.0f + i))));
            pool.wake();
            stored();
        }
        EXPECT_TRUE(testing::eventually([&] { return store().queueDepth()->jobs == 0; }));
        rebuild(driver, *made);
        EXPECT_EQ(store().stats()->shapesReady, kScans - 1u);
        EXPECT_EQ(store().stats()->shapesFailed, 1u) << "no death fails a scan";
        EXPECT_EQ(store().check({})->size(), 0u);
    }

    store::Store& store() { return *world_.store; }
    static constexpr int kScans = 6;

  private:
    static ingest::SignaturePipeline pipeline() { return testing::quickDescribe; }

    void rebuild(ingest::RebuildDriver& driver, const store::Collection& collection) {
        const auto parameters = store::decodeParameters(testing::paperParameters(5));
        auto rebuild = driver.begin(collection, *parameters);
        ASSERT_TRUE(rebuild) << rebuild.error().message;
        while (rebuild && rebuild->state == store::RebuildState::kRunning)
            rebuild = driver.waitForChange(*rebuild, {});
        ASSERT_TRUE(rebuild);
        EXPECT_EQ(rebuild->state, store::RebuildState::kDone);
    }

    std::string folder_;
    World world_;
    std::shared_ptr<testing::RecordingLogger> log_;
    std::unique_ptr<index::CollectionIndex> index_;
    ingest::ProgressBoard board_;
    ingest::CrashIsolation isolation_;
};

/// Dies while scans are segmented; a second process ends the work. Some places are reached only once.
void dieWorking(const std::string& name, int time) {
    SCOPED_TRACE(name + ", reached for the " + std::to_string(time) + ". time");
    const testing::TemporaryDirectory folder;
    Pipe acknowledged;
    const int exit = inChild([&] {
        Failpoints::dieAt(name, time);
        Server(folder.path()).work([&] { acknowledged.put(); });
    });
    if (time > 1 && exit == 0) return;
    ASSERT_EQ(exit, kDiedThere);
    ++deathCount;
    const auto scans = static_cast<int>(acknowledged.count());
    const int next = inChild([&] {
        Server server(folder.path());
        for (int i = 0; i < scans; ++i) {
            const auto shape = server.store().getShape(1, "k" + std::to_string(i));
            EXPECT_TRUE(shape && server.store().loadPoints(shape->id)) << "scan " << i << " is lost";
        }
        server.work([] {});
    });
    EXPECT_EQ(next, 0) << "the next process";
}

const Step kOpen{"open", [](World& world) { return world.open(); }};

/// Of a collection that takes several transactions to delete.
std::vector<Step> largeCollection() {
    return {kOpen, {"fill", [](World& world) -> Result<void> {
                        const auto made = world.store->createCollection("large", "", "");
                        for (int i = 0; made && i < 600; ++i) {
                            EXPECT_TRUE(world.store->putShape(testing::putRequest(
                                made->id, std::to_string(i), testing::taggedPoints(1.0f))));
                        }
                        return {};
                    }}};
}
const Step kDeleteIt{"delete a large collection", [](World& world) -> Result<void> {
                         return world.store->deleteCollection(world.store->getCollection("large")->id);
                     }};

const char* const kNoticed = "failpoint:open.noticed";

/// Changes are missing: dies where that is noted, and the next start tells it.
void dieNoticing() {
    Image files = filesAfter({kOpen, {"create", [](World& world) -> Result<void> {
                                          const auto made = world.store->createCollection("a", "", "");
                                          return made ? Result<void>() : fail(made.error());
                                      }}});
    files["shapes.db.commits"] = "shapedb commits 00000000000000000009\n";
    const testing::TemporaryDirectory folder;
    for (const auto& [file, bytes] : files) writeFile(folder.file(file), bytes);
    const int exit = inChild([&] {
        Failpoints::dieAt(kNoticed, 1);
        static_cast<void>(World(folder.path()).open());
    });
    ASSERT_EQ(exit, kDiedThere);
    ++deathCount;
    for (int start = 0; start < 2; ++start) {
        World after(folder.path());
        ASSERT_TRUE(after.open());
        EXPECT_EQ(after.store->stats()->missingCommits, 8u);
        EXPECT_EQ(after.store->findings().size(), 1u);
    }
}

// One test, so that it knows of all failpoints whether the process died there.
TEST(FailpointTest, EachIsSurvived) {
    const auto whole = dieEverywhere(recordWholeScript, {});
    std::set<std::string> died = whole;
    for (const Moment& moment : recordMigrations()) {
        const auto names = dieEverywhere([&] { return std::vector<Moment>{moment}; }, moment.files);
        died.insert(names.begin(), names.end());
    }
    const Image large = filesAfter(largeCollection());
    const auto deleting = dieEverywhere([&] { return record({kOpen, kDeleteIt}, large); }, large);
    EXPECT_EQ(deleting.count("failpoint:delete.some"), 1u);
    died.insert(deleting.begin(), deleting.end());
    dieNoticing();
    died.insert(kNoticed);
    const std::set<std::string> all = Failpoints::inSources();
    for (const std::string& name : all) {
        if (whole.count(name) != 0 || deleting.count(name) != 0 || name == kNoticed) continue;
        dieWorking(name, 1);
        dieWorking(name, 2);
        if (HasFailure()) return;  // a child would inherit it
        died.insert(name);
    }
    EXPECT_GE(all.size(), 20u);
    EXPECT_EQ(died, all);
    std::cout << all.size() << " failpoints, " << deathCount << " deaths\n";
}

bool holdFailpoints(const std::string& paths) {
    std::istringstream list(paths);
    for (std::string path; std::getline(list, path, ':');) {
        const std::string bytes = readFile(path);
        EXPECT_FALSE(bytes.empty()) << path;
        if (bytes.find("failpoint:") != std::string::npos) return true;
    }
    return false;
}

TEST(FailpointTest, NoProgramHoldsOne) {
    EXPECT_FALSE(holdFailpoints(SHAPEDB_LIBRARIES));
    EXPECT_TRUE(holdFailpoints(SHAPEDB_FAILPOINT_LIBRARIES)) << "they would be found";
}

}  // namespace
}  // namespace shapedb::reliability
