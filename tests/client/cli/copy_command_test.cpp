// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin copy` between two real servers, of which the first is written to all the time.
#include <atomic>
#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <sys/wait.h>

#include "client/api/client.h"
#include "core/base/random.h"
#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"
#include "tests/server/support/postgres_cluster.h"
#include "tests/support/eventually.h"

namespace shapedb::cli {
namespace {

using client::Client;
using nlohmann::json;
using testing::eventually;
using testing::ServerProcess;
using testing::TemporaryDirectory;

Client connected(const ServerProcess& server) {
    client::ClientOptions options;
    options.address = server.address();
    return *Client::connect(std::move(options));
}

/// What a copy must bring, by collection and key: points, origin and metadata. A collection that goes while
/// it is read leaves a mark, with which nothing is equal that has been read whole.
using Content = std::map<std::string, std::string>;

Content contentOf(const Client& client) {
    Content content;
    const auto collections = client.listCollections();
    if (!collections) return {{"unreadable", collections.error().message}};
    for (const client::Collection& collection : *collections) {
        content[collection.name] = collection.description;
        for (const std::string& alias : collection.aliases) content["alias " + alias] = collection.name;
        client::ListRequest request;
        request.collection = collection.name;
        do {
            const auto page = client.listShapes(request);
            if (!page) return {{"unreadable", page.error().message}};
            for (const client::Shape& shape : page->shapes) {
                std::string text = shape.sha256 + " " + std::to_string(shape.origin.x);
                for (const auto& [name, value] : shape.metadata) text += " " + name + "=" + value;
                content[collection.name + "/" + shape.key] = text;
            }
            request.cursor = page->nextCursor;
        } while (!request.cursor.empty());
    }
    return content;
}

/// Adds, replaces, renames the labels of, and deletes shapes, and makes and deletes collections, until it
/// ends.
class Writer {
  public:
    explicit Writer(const ServerProcess& server) : client_(connected(server)) {
        thread_ = std::thread([this] {
            while (!stop_) write();
        });
    }
    ~Writer() { end(); }
    void end() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }

  private:
    void write() {
        const std::string key = "shape " + std::to_string(random_.below(40));
        const std::uint64_t what = random_.below(10);
        if (what < 5) {
            client::AddRequest request;
            request.shape = {"c", key};
            request.metadata = client::Metadata{{"label", std::to_string(random_.below(5))}};
            PointCloud points = ellipsoidPoints(1.0, 2.0 + random_.uniform(0.0, 1.0), 3.0, 60);
            // Far from the origin they are sent relative to a point nearby.
            if (what == 0) {
                for (Point3& p : points) p.x += 4.5e6;
            }
            EXPECT_TRUE(client_.addShape(request, points));
        } else if (what < 7) {
            client::MetadataChange change;
            change.set = {{"label", "new"}, {"note", std::to_string(random_.below(100))}};
            if (what == 6) change.remove = {"note"}, change.set.erase("note");
            (void)client_.updateMetadata({"c", key}, change);
        } else if (what < 9) {
            (void)client_.deleteShape({"c", key});
        } else {
            const std::string name = "other" + std::to_string(random_.below(2));
            if (!client_.createCollection(name, name, {})) (void)client_.deleteCollection(name, true);
            (void)client_.setAlias("current", "c");
        }
    }

    Client client_;
    Random random_{7};
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

class Copy : public CommandTest {
  protected:
    Copy() : from_(std::make_unique<ServerProcess>(source_.path())) {
        client::Parameters paper;
        paper.profile = Profile::kPaper;
        EXPECT_TRUE(here().createCollection("c", "of the test", paper));
        for (int i = 0; i < 20; ++i) add("shape " + std::to_string(i));
    }

    void startTarget(const std::vector<std::string>& flags = {}) {
        to_ = std::make_unique<ServerProcess>(target_.path(), flags);
    }
    [[nodiscard]] Client here() const { return connected(*from_); }
    [[nodiscard]] Client there() const { return connected(*to_); }

    void add(const std::string& key, double length = 3.0, std::size_t points = 60) const {
        client::AddRequest request;
        request.shape = {"c", key};
        request.metadata = client::Metadata{{"label", "first"}};
        EXPECT_TRUE(here().addShape(request, ellipsoidPoints(1.0, 2.0, length, points)));
    }

    [[nodiscard]] std::vector<std::string> words(std::vector<std::string> flags) const {
        flags.insert(flags.begin(), {"admin", "copy", from_->address(), to_->address()});
        flags.insert(flags.end(), {"--timeout", "100"});
        return flags;
    }
    [[nodiscard]] CommandRun copy(const std::vector<std::string>& flags) const {
        return runCommand(words(flags));
    }
    /// Until segmentation is done on both sides.
    void settle() const {
        for (const Client& client : {here(), there()}) {
            EXPECT_TRUE(eventually([&] { return client.stats()->shapesPending == 0; }));
        }
    }
    void expectAlike() const {
        EXPECT_EQ(contentOf(there()), contentOf(here()));
        settle();
        const CommandRun verified = copy({"--verify", "--json"});
        EXPECT_EQ(verified.exitCode, 0) << verified.out;
        EXPECT_EQ(verified.json()["equal"], true);
    }
    [[nodiscard]] bool alike() const {
        const Content content = contentOf(here());
        return content.count("unreadable") == 0 && contentOf(there()) == content;
    }
    [[nodiscard]] bool soonAlike() const {
        return eventually([&] { return alike(); }, std::chrono::seconds(60), std::chrono::milliseconds(100));
    }
    /// Ends a command that follows, which has not lost what it has seen.
    static void interrupt(int process) {
        // A pass must have seen that the two are alike.
        std::this_thread::sleep_for(std::chrono::seconds(4));
        ::kill(process, SIGINT);
        int status = 0;
        EXPECT_EQ(::waitpid(process, &status, 0), process);
        EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    }
    /// The command with these flags while somebody writes for `seconds`, and until the two are alike.
    void copyUnderWrites(const std::vector<std::string>& flags, double seconds) const {
        Writer writer(*from_);
        const int process = startCommand(words(flags));
        std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
        writer.end();
        EXPECT_TRUE(soonAlike());
        interrupt(process);
    }

    TemporaryDirectory source_;
    TemporaryDirectory target_;
    std::unique_ptr<ServerProcess> from_;
    std::unique_ptr<ServerProcess> to_;
};

TEST_F(Copy, LosesNothingThatIsWrittenMeanwhile) {
    startTarget();
    copyUnderWrites({}, 4.0);
    expectAlike();
    EXPECT_GE(contentOf(there()).size(), 20u);
}

TEST_F(Copy, LeadsToPostgresAndBack) {
    testing::PostgresCluster* postgres = nullptr;
    SHAPEDB_USE_POSTGRES(postgres);
    startTarget({"--store-engine", "postgres", "--postgres-uri", postgres->createDatabase()});
    copyUnderWrites({}, 4.0);
    expectAlike();
    std::swap(from_, to_);
    copyUnderWrites({"--force"}, 3.0);
    expectAlike();
}

TEST_F(Copy, ThatWasKilledIsContinued) {
    startTarget();
    Writer writer(*from_);
    for (const int milliseconds : {30, 150, 700, 1500}) {
        const bool begun = there().stats()->collections > 1;
        const int process = startCommand(words({begun ? "--continue" : "--force"}));
        std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
        ::kill(process, SIGKILL);
        ::waitpid(process, nullptr, 0);
    }
    writer.end();
    const CommandRun last = copy({"--continue", "--once", "--json"});
    EXPECT_EQ(last.exitCode, 0) << last.err;
    EXPECT_EQ(last.json()["restored"], json());
    EXPECT_EQ(last.json()["alike"], true);
    expectAlike();
}

TEST_F(Copy, KeepsWhatTheBackupHas) {
    startTarget();
    EXPECT_TRUE(eventually([&] { return here().stats()->shapesPending == 0; }));
    const auto before = here().getShape({"c", "shape 3"});
    const CommandRun run = copy({"--once"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("20 shapes in 2 collections copied from " + from_->address()), std::string::npos)
        << run.out;
    EXPECT_NE(run.out.find(to_->address() + " has what " + from_->address() + " has\n"), std::string::npos)
        << run.out;
    const auto after = there().getShape({"c", "shape 3"});
    EXPECT_EQ(after->id, before->id);
    EXPECT_EQ(after->version, before->version);
    EXPECT_EQ(after->created, before->created);
    EXPECT_EQ(after->state, client::ShapeState::kReady) << "nothing is segmented again";
}

TEST_F(Copy, FollowsUntilItIsInterrupted) {
    startTarget();
    const int process = startCommand(words({}));
    EXPECT_TRUE(soonAlike());
    add("late");
    EXPECT_TRUE(here().deleteShape({"c", "shape 1"}));
    EXPECT_TRUE(soonAlike());
    EXPECT_TRUE(here().renameCollection("c", "renamed"));
    EXPECT_TRUE(here().setAlias("c", "renamed"));
    EXPECT_TRUE(soonAlike());
    EXPECT_EQ(there().getShape({"renamed", "shape 2"})->version, 1) << "its shapes were not copied again";
    client::RebuildRequest rebuild;
    rebuild.collection = "renamed";
    rebuild.parameters.mergeRatio = 1.75;
    EXPECT_TRUE(here().rebuild(rebuild, {}));
    EXPECT_TRUE(eventually([&] { return there().getCollection("c")->parameters.mergeRatio == 1.75; }));
    interrupt(process);
    expectAlike();
}

TEST_F(Copy, NamesWhatDiffers) {
    startTarget();
    EXPECT_EQ(copy({"--once"}).exitCode, 0);
    add("here alone");
    add("shape 4", 4.0);
    EXPECT_TRUE(here().updateMetadata({"c", "shape 5"}, {{{"label", "other"}}}));
    EXPECT_TRUE(here().deleteShape({"c", "shape 6"}));
    EXPECT_TRUE(here().setAlias("current", "c"));
    settle();
    const CommandRun run = copy({"--verify"});
    EXPECT_EQ(run.exitCode, 1) << run.err;
    for (const char* line : {"c/here alone: missing\n", "c/shape 4: points\n", "c/shape 5: metadata\n",
                             "c/shape 6: extra\n", "alias current stands for c\n", "not equal\n"}) {
        EXPECT_NE(run.out.find(line), std::string::npos) << line << run.out;
    }
    const json found = copy({"--verify", "--json"}).json();
    EXPECT_EQ(found["equal"], false);
    EXPECT_EQ(found["different"], 4);
    EXPECT_EQ(found["differences"].size(), 4u);
    EXPECT_EQ(found["collections_differ"], json({"alias current stands for c"}));
    EXPECT_EQ(contentOf(there()).count("c/here alone"), 0u) << "nothing was copied";
}

TEST_F(Copy, SaysWhatTheOtherServerRefuses) {
    startTarget({"--limits-max-points", "100"});
    EXPECT_EQ(copy({"--once"}).exitCode, 0);
    add("large", 3.0, 300);
    const CommandRun run = copy({"--continue", "--once", "--json"});
    EXPECT_EQ(run.exitCode, 1) << run.err;
    EXPECT_NE(run.err.find("c/large: "), std::string::npos) << run.err;
    ASSERT_EQ(run.json()["refused"].size(), 1u) << run.out;
    EXPECT_EQ(run.json()["refused"][0]["error"]["name"], "point_limit_exceeded");
}

TEST_F(Copy, MistakesAreExplained) {
    startTarget();
    EXPECT_EQ(copy({"--once"}).exitCode, 0);
    const auto refused = [&](const std::vector<std::string>& arguments, int exitCode,
                             const std::string& words) {
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, exitCode) << run.err;
        EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    };
    refused(words({"--once"}), 4, "20 shapes: --continue copies what differs");
    refused(words({"--continue", "--force"}), 2, "--force");
    refused(words({"--verify", "--once"}), 2, "--once");
    const std::string here = from_->address();
    refused({"admin", "copy", here, here}, 2, "are the same server");
    refused({"admin", "copy", here, "localhost" + here.substr(here.rfind(':'))}, 2, "are the same server");
    refused({"admin", "copy", here}, 2, "TO");
    refused({"admin", "copy", here, "127.0.0.1:1", "--once"}, 5, "127.0.0.1:1");
    refused(words({"--to-key-file", path("none")}), 3, path("none"));
}

}  // namespace
}  // namespace shapedb::cli
