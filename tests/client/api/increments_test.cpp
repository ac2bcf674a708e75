// SPDX-License-Identifier: GPL-3.0-or-later
// Incremental backups of a real server: whatever happens between them, the chain gives back what there was.
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "client/api/client.h"
#include "core/base/random.h"
#include "tests/client/backup/backup_files.h"
#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"
#include "tests/support/eventually.h"

namespace shapedb::client {
namespace {

namespace fs = std::filesystem;
using shapedb::testing::ServerProcess;
using shapedb::testing::TemporaryDirectory;

Client clientOf(const ServerProcess& server) {
    ClientOptions options;
    options.address = server.address();
    options.retry.maxAttempts = 2;
    auto client = Client::connect(options);
    EXPECT_TRUE(client) << client.error().message;
    return std::move(*client);
}

PointCloud randomScan(Random& random) {
    const auto axis = [&] { return 0.5 + 0.1 * static_cast<double>(random.next() % 20); };
    return cli::ellipsoidPoints(axis(), axis(), axis(), 300 + random.next() % 200);
}

PointCloud noise(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points(count);
    for (Point3& p : points) p = {random.uniform(), random.uniform(), random.uniform()};
    return points;
}

std::string bitsOf(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return std::to_string(bits);
}

/// What the database should hold.
struct Expected {
    struct Scan {
        PointCloud points;
        Metadata metadata;
    };
    std::map<std::string, Scan> shapes;  ///< of the collection "c"
    std::map<std::string, std::string> aliases;
};

class Increments : public ::testing::Test {
  protected:
    Increments() : server_(folder_.path() + "/one"), client_(clientOf(server_)) {
        Parameters parameters;
        parameters.profile = Profile::kPaper;
        EXPECT_TRUE(client_.createCollection("c", "", parameters));
    }

    std::string path(const std::string& name) const { return folder_.file(name); }

    void add(const std::string& key, Random& random) {
        Expected::Scan scan{randomScan(random), {{"n", std::to_string(random.next() % 5)}}};
        AddRequest request{{"c", key}};
        request.metadata = scan.metadata;
        request.wait = true;
        const auto added = client_.addShape(request, scan.points);
        ASSERT_TRUE(added) << added.error().message;
        expected_.shapes[key] = scan;
    }
    std::string anyKey(Random& random) const {
        auto shape = expected_.shapes.begin();
        std::advance(shape, static_cast<long>(random.next() % expected_.shapes.size()));
        return shape->first;
    }

    void changeSomething(Random& random) {
        const std::string key = anyKey(random);
        switch (random.next() % 6) {
            case 0:
            case 1: return add("new-" + std::to_string(random.next() % 1'000'000), random);
            case 2: return add(key, random);  // replaced
            case 3:
                if (expected_.shapes.size() < 4) return;
                ASSERT_TRUE(client_.deleteShape({"c", key}));
                expected_.shapes.erase(key);
                return;
            case 4: {
                const std::string value(random.next() % 900, 'x');
                ASSERT_TRUE(client_.updateMetadata({"c", key}, {{{"changed", value}}, {}, false}));
                expected_.shapes[key].metadata["changed"] = value;
                return;
            }
            default:
                if (random.next() % 2 == 0) {
                    RebuildRequest request;
                    request.collection = "c";
                    ASSERT_TRUE(client_.rebuild(request, [](const auto&) {}));
                } else {
                    const std::string alias = "alias-" + std::to_string(random.next() % 3);
                    ASSERT_TRUE(client_.setAlias(alias, "c"));
                }
        }
    }

    /// Everything that can be asked, as text.
    static std::vector<std::string> contentOf(const Client& client) {
        std::vector<std::string> lines;
        const auto collections = client.listCollections();
        EXPECT_TRUE(collections);
        for (const Collection& one : *collections) {
            std::string line = one.name + " generation " + std::to_string(one.generation);
            for (const std::string& alias : one.aliases) line += " alias " + alias;
            lines.push_back(line);
        }
        const auto page = client.listShapes({"c"});
        EXPECT_TRUE(page) << page.error().message;
        for (const Shape& shape : page->shapes) {
            std::string line = shape.key + " version " + std::to_string(shape.version) + " id " +
                               std::to_string(shape.id) + " " + stateName(shape.state);
            for (const auto& [key, value] : shape.metadata) line.append(" ").append(key + "=" + value);
            const auto points = client.getPoints({"c", shape.key});
            EXPECT_TRUE(points) << points.error().message;
            for (const Point3& p : points->points) line += bitsOf(p.x) + bitsOf(p.y) + bitsOf(p.z);
            lines.push_back(line);
            SearchOptions options;
            options.collection = "c";
            options.k = 20;
            const auto found = client.searchByKey(options, shape.key, true);
            EXPECT_TRUE(found) << found.error().message;
            for (const Hit& hit : found->hits) lines.push_back(hit.shape.key + " " + bitsOf(hit.score));
        }
        return lines;
    }

    void expectAsExpected(const Client& client) const {
        const auto page = client.listShapes({"c"});
        ASSERT_TRUE(page);
        ASSERT_EQ(page->shapes.size(), expected_.shapes.size());
        for (const auto& [key, scan] : expected_.shapes) {
            const auto stored = client.getPoints({"c", key});
            ASSERT_TRUE(stored) << key;
            EXPECT_EQ(stored->shape.metadata, scan.metadata) << key;
            ASSERT_EQ(stored->points.size(), scan.points.size()) << key;
            for (std::size_t i = 0; i < scan.points.size(); ++i) {
                ASSERT_EQ(static_cast<float>(stored->points[i].x), static_cast<float>(scan.points[i].x))
                    << key;
            }
        }
    }

    TemporaryDirectory folder_;
    ServerProcess server_;
    Client client_;
    Expected expected_;
};

TEST_F(Increments, TenInARowGiveBackWhatThereWas) {
    Random random(20);
    for (int i = 0; i < 6; ++i) add("k" + std::to_string(i), random);
    std::vector<std::string> chain{path("full.db")};
    ASSERT_TRUE(client_.backupToFile(chain[0]));
    const TemporaryDirectory elsewhere;
    const ServerProcess second(elsewhere.path());
    const Client restored = clientOf(second);
    for (int i = 0; i < 10; ++i) {
        for (std::uint64_t changes = 1 + random.next() % 4; changes > 0; --changes) {
            ASSERT_NO_FATAL_FAILURE(changeSomething(random));
        }
        const std::string increment = path("inc" + std::to_string(i) + ".sdbi");
        const auto report = client_.incrementToFile(increment, chain.back());
        ASSERT_TRUE(report) << report.error().message;
        EXPECT_EQ(report->bytes, fs::file_size(increment));
        EXPECT_LT(report->bytes, fs::file_size(chain[0])) << "smaller than a full backup";
        chain.push_back(increment);

        const auto merged = mergeBackups(chain, path("merged.db"));
        ASSERT_TRUE(merged) << merged.error().message;
        EXPECT_EQ(merged->sha256, report->backup.sha256);
        EXPECT_EQ(merged->bytes, report->backup.bytes);

        // In turn the merged file and the chain itself.
        const auto put =
            i % 2 == 0 ? restored.restoreFromFile(path("merged.db")) : restored.restoreFromFiles(chain);
        ASSERT_TRUE(put) << put.error().message;
        EXPECT_EQ(put->shapes, expected_.shapes.size());
        ASSERT_NO_FATAL_FAILURE(expectAsExpected(restored));
        EXPECT_EQ(contentOf(restored), contentOf(client_)) << "increment " << i;
        const auto problems = restored.check([](const auto&) {});
        ASSERT_TRUE(problems);
        EXPECT_TRUE(problems->empty()) << problems->front();
    }
    // The chain goes on from a merged backup as from its own last increment.
    ASSERT_TRUE(client_.incrementToFile(path("on.sdbi"), path("merged.db")));
    chain.push_back(path("on.sdbi"));
    EXPECT_TRUE(mergeBackups(chain, path("again.db")));
}

TEST_F(Increments, AnUnchangedDatabaseGivesAnEmptyIncrement) {
    Random random(1);
    add("k", random);
    const std::string full = path("full.db");
    ASSERT_TRUE(client_.backupToFile(full));
    const auto report = client_.incrementToFile(path("inc.sdbi"), full);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->changedBytes, 0u);
    ASSERT_TRUE(mergeBackups({full, path("inc.sdbi")}, path("merged.db")));
    EXPECT_EQ(testing::readBytes(path("merged.db")), testing::readBytes(full));
}

// After a restore the pages are where the backup had them: the old chain can go on.
TEST_F(Increments, AChainGoesOnAfterARestore) {
    Random random(2);
    for (int i = 0; i < 20; ++i) add("k" + std::to_string(i), random);
    const std::string full = path("full.db");
    ASSERT_TRUE(client_.backupToFile(full));
    ASSERT_TRUE(client_.deleteShapes({"c", {}, ""}));
    ASSERT_TRUE(client_.restoreFromFile(full));
    const auto report = client_.incrementToFile(path("inc.sdbi"), full);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LT(report->changedBytes, report->backup.bytes / 2);
    ASSERT_TRUE(client_.restoreFromFiles({full, path("inc.sdbi")}));
    expectAsExpected(client_);
}

TEST_F(Increments, NeitherExistingFilesNorStrangeOnesAreTaken) {
    Random random(3);
    add("k", random);
    const std::string full = path("full.db");
    ASSERT_TRUE(client_.backupToFile(full));
    EXPECT_EQ(client_.incrementToFile(full, full).error().code, ErrorCode::kAlreadyExists);
    ASSERT_TRUE(client_.incrementToFile(path("inc.sdbi"), full));
    EXPECT_EQ(client_.incrementToFile(path("inc.sdbi"), full).error().code, ErrorCode::kAlreadyExists);
    const std::string text = testing::writeBytes(path("text"), "no backup");
    EXPECT_EQ(client_.incrementToFile(path("new"), text).error().code, ErrorCode::kMalformedFile);
    EXPECT_EQ(client_.incrementToFile(path("new"), path("none")).error().code, ErrorCode::kFileNotReadable);

    // A damaged chain reaches the end of the upload nowhere: the server keeps what it has.
    std::string bytes = testing::readBytes(path("inc.sdbi"));
    ASSERT_TRUE(client_.deleteShape({"c", "k"}));
    ASSERT_TRUE(client_.incrementToFile(path("gone.sdbi"), path("inc.sdbi")));
    bytes = testing::readBytes(path("gone.sdbi"));
    bytes.back() ^= 1;
    testing::writeBytes(path("gone.sdbi"), bytes);
    add("other", random);
    EXPECT_EQ(client_.restoreFromFiles({full, path("inc.sdbi"), path("gone.sdbi")}).error().code,
              ErrorCode::kMalformedFile);
    EXPECT_TRUE(client_.getShape({"c", "other"}));
}

class InterruptedIncrements : public Increments {
  protected:
    /// So many bytes change that the network cannot hold them.
    void prepare() {
        Random random(4);
        add("k", random);
        ASSERT_TRUE(client_.backupToFile(path("full.db")));
        for (int i = 0; i < 8; ++i) {
            const PointCloud points = noise(150'000, static_cast<std::uint64_t>(i));
            ASSERT_TRUE(client_.addShape({{"", "large" + std::to_string(i)}}, points));
        }
    }
    Result<IncrementReport> increment(const std::function<void()>& atFirstBytes,
                                      const std::atomic<bool>* cancel = nullptr) {
        RunContext context;
        context.cancel = cancel;
        context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
            if (std::strcmp(stage, "increment") == 0) atFirstBytes();
        };
        return client_.incrementToFile(path("inc.sdbi"), path("full.db"), context);
    }
    void expectNothingLeft() const {
        EXPECT_FALSE(fs::exists(path("inc.sdbi")));
        EXPECT_FALSE(fs::exists(path("inc.sdbi.part")));
    }
};

TEST_F(InterruptedIncrements, AKilledServerLeavesNoFileAndTheNextRunWorks) {
    prepare();
    bool killed = false;
    const auto failed = increment([&] {
        if (!killed) server_.kill();
        killed = true;
    });
    ASSERT_TRUE(killed);
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::kUnavailable) << failed.error().message;
    expectNothingLeft();

    const ServerProcess again(folder_.path() + "/one");
    EXPECT_TRUE(fs::is_empty(folder_.path() + "/one/data/tmp")) << "a start removes what a dead server sent";
    const Client client = clientOf(again);
    const auto report = client.incrementToFile(path("inc.sdbi"), path("full.db"));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_TRUE(mergeBackups({path("full.db"), path("inc.sdbi")}, path("merged.db")));
}

TEST_F(InterruptedIncrements, ACancelledRunLeavesNoFile) {
    prepare();
    std::atomic<bool> cancel{false};
    const auto failed = increment([&] { cancel = true; }, &cancel);
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::kCancelled) << failed.error().message;
    expectNothingLeft();
    // The server has given the place of a copy back.
    EXPECT_TRUE(shapedb::testing::eventually(
        [&] { return client_.incrementToFile(path("inc.sdbi"), path("full.db")).has_value(); }));
}

TEST_F(InterruptedIncrements, AKilledCommandLeavesNoHalfFile) {
    prepare();
    for (int i = 0; i < 6; ++i) {
        const std::string file = path("inc" + std::to_string(i) + ".sdbi");
        const int process = cli::startCommand({"admin", "backup", file, "--since", path("full.db"),
                                               "--server", server_.address(), "--timeout", "60"});
        std::this_thread::sleep_for(std::chrono::milliseconds(25 * i));
        ::kill(process, SIGKILL);
        ::waitpid(process, nullptr, 0);
        if (!fs::exists(file)) continue;
        EXPECT_TRUE(mergeBackups({path("full.db"), file}, path("merged.db"))) << "whole, or not there";
    }
    const std::string file = path("inc0.sdbi");
    fs::remove(file);
    EXPECT_TRUE(shapedb::testing::eventually(
        [&] { return client_.incrementToFile(file, path("full.db")).has_value(); }));
    EXPECT_FALSE(fs::exists(file + ".part")) << "what the killed one left was used up";
}

}  // namespace
}  // namespace shapedb::client
