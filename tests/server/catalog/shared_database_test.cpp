// SPDX-License-Identifier: GPL-3.0-or-later
// Servers that share a database: what one changes, each other one searches; and together they answer as one
// server with a database of its own.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/search/top_k.h"
#include "server/catalog/catalog.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/postgres_cluster.h"
#include "tests/support/eventually.h"
#include "tests/support/scale.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

/// Signature and metadata of each key of each collection, as a server searches them; and which names it
/// knows.
using Content = std::map<std::string, std::map<std::string, std::string>>;

Content contentOf(const Catalog& server) {
    Content content;
    const auto collections = server.collections().value();
    for (const index::SnapshotPtr& snapshot : collections) {
        auto& keys = content[snapshot->collection.name];
        for (const std::string& alias : server.aliasesOf(*snapshot)) content["alias " + alias];
        for (const auto& block : snapshot->signatures.blocks()) {
            for (std::size_t row = 0; row < block->size(); ++row) {
                std::string text = std::to_string(block->rows()[row].points[0].weight) + " " +
                                   std::to_string(snapshot->collection.generation);
                for (const auto& [name, value] : block->metadata(row)) text += " " + name + "=" + value;
                keys[std::string(block->key(row))] = text;
            }
        }
    }
    return content;
}

class SharedDatabaseTest : public ::testing::Test {
  protected:
    void SetUp() override {
        SHAPEDB_USE_POSTGRES(cluster_);
        uri_ = cluster_->createDatabase();
        for (const char* name : {"one", "two"}) servers_.push_back(start(name));
    }
    void TearDown() override {
        for (const auto& server : servers_) EXPECT_TRUE(server->stop());
    }

    std::unique_ptr<store::Store> openStore(const std::string& name,
                                            std::chrono::milliseconds lease = 60s) const {
        store::PostgresOptions options;
        options.uri = uri_;
        options.serverName = name;
        options.connections = 4;
        options.lockPath = folder_.file(name);
        options.temporaryFolder = folder_.file("");
        options.jobLease = lease;
        auto opened = store::openPostgresStore(options);
        EXPECT_TRUE(opened) << opened.error().message;
        return std::move(*opened);
    }
    std::unique_ptr<Catalog> start(std::unique_ptr<store::Store> opened) const {
        CatalogOptions options;
        options.maxQueuedJobs = 1'000;
        options.workers.threads = 1;
        options.rebuilds.yield = 1ms;
        auto server = std::make_unique<Catalog>(std::move(opened), quickDescribe, log_, options);
        EXPECT_TRUE(server->start());
        return server;
    }
    std::unique_ptr<Catalog> start(const std::string& name) const { return start(openStore(name)); }

    static Result<AddedShape> put(Catalog& server, const std::string& key, float tag, Metadata metadata = {},
                                  const std::string& collection = "") {
        ShapeHeader header;
        header.collection = collection;
        header.key = key;
        header.metadata = store::replacedBy(std::move(metadata));
        return server.put(header, store::VerifiedScan::verify(taggedPoints(tag)).value());
    }
    /// Both servers know the same, and it is what `expected` says.
    void expectBoth(const std::function<bool(const Content&)>& expected, const std::string& what) {
        for (const auto& server : servers_) {
            ASSERT_TRUE(eventually([&] { return expected(contentOf(*server)); })) << what;
        }
    }

    TemporaryDirectory folder_;
    PostgresCluster* cluster_ = nullptr;
    std::string uri_;
    std::shared_ptr<RecordingLogger> log_ = std::make_shared<RecordingLogger>();
    std::vector<std::unique_ptr<Catalog>> servers_;
};

TEST_F(SharedDatabaseTest, EveryChangeIsSeenByBoth) {
    Catalog& one = *servers_[0];
    Catalog& two = *servers_[1];
    const auto has = [](const std::string& collection, const std::string& key) {
        return [=](const Content& content) {
            const auto found = content.find(collection);
            return found != content.end() && found->second.count(key) == 1;
        };
    };
    ASSERT_TRUE(put(one, "cup", 5.0f));
    expectBoth(has("default", "cup"), "a shape");
    ASSERT_TRUE(two.createCollection("parts", "", parametersOf(Profile::kDefault)));
    expectBoth([](const Content& content) { return content.count("parts") == 1; }, "a collection");
    ASSERT_TRUE(put(one, "bolt", 7.0f, {}, "parts"));
    expectBoth(has("parts", "bolt"), "a shape of a new collection");
    ASSERT_TRUE(put(two, "bolt", 7.0f, {{"label", "screw"}}, "parts"));
    expectBoth(
        [](const Content& c) { return c.at("parts").at("bolt").find("label=screw") != std::string::npos; },
        "metadata");
    ASSERT_TRUE(one.setAlias("current", "parts"));
    expectBoth([](const Content& content) { return content.count("alias current") == 1; }, "an alias");
    ASSERT_TRUE(two.renameCollection("parts", "pieces"));
    expectBoth([](const Content& c) { return c.count("pieces") == 1 && c.count("parts") == 0; }, "a name");
    ASSERT_TRUE(two.deleteAlias("current"));
    expectBoth([](const Content& content) { return content.count("alias current") == 0; }, "no alias");
    ASSERT_TRUE(two.deleteShape("pieces", "bolt", std::nullopt));
    expectBoth([](const Content& content) { return content.at("pieces").empty(); }, "a deletion");
    ASSERT_TRUE(one.deleteCollection("pieces", true));
    expectBoth([](const Content& content) { return content.count("pieces") == 0; }, "no collection");
}

TEST_F(SharedDatabaseTest, ARebuildIsOneEntryOfTheLog) {
    for (int i = 0; i < 20; ++i)
        ASSERT_TRUE(put(*servers_[0], "k" + std::to_string(i), 1.0f + static_cast<float>(i)));
    expectBoth([](const Content& content) { return content.at("default").size() == 20; }, "all shapes");
    ParameterOverrides change;
    change.maxPoints = 9;
    ASSERT_TRUE(servers_[0]->beginRebuilds({"default"}, change));
    expectBoth(
        [](const Content& content) {
            std::size_t switched = 0;
            for (const auto& [key, text] : content.at("default"))
                switched += text.find(" 2") != std::string::npos;
            EXPECT_TRUE(switched == 0 || switched == content.at("default").size()) << "mixed generations";
            return switched == 20;
        },
        "the next generation");
}

TEST_F(SharedDatabaseTest, ARestoreByOneIsLoadedByTheOther) {
    ASSERT_TRUE(put(*servers_[0], "before", 3.0f));
    expectBoth([](const Content& content) { return content.at("default").size() == 1; }, "a shape");
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(servers_[1]->backup(backup, {}));
    ASSERT_TRUE(put(*servers_[0], "after", 4.0f));
    expectBoth([](const Content& content) { return content.at("default").size() == 2; }, "another");
    const auto restored = servers_[0]->restore(backup, {});
    ASSERT_TRUE(restored) << restored.error().message;
    expectBoth(
        [](const Content& c) { return c.at("default").size() == 1 && c.at("default").count("before") == 1; },
        "the content of the backup");
}

TEST_F(SharedDatabaseTest, BothImportAtTheSameTime) {
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(put(*servers_[0], "k" + std::to_string(i), 2.0f));
    expectBoth([](const Content& content) { return content.at("default").size() == 100; }, "all shapes");
    const std::string file = folder_.file("export.db");
    ASSERT_TRUE(servers_[0]->exportCollection("default", file, {}));
    const auto has = [](const Content& content, const std::string& name, std::size_t shapes) {
        const auto found = content.find(name);
        return found != content.end() && found->second.size() == shapes;
    };
    const auto mayUse = [](const std::string&) { return Result<void>(); };
    std::vector<std::thread> importing;
    for (std::size_t i = 0; i < servers_.size(); ++i) {
        importing.emplace_back([&, i] {
            const auto done = servers_[i]->importCollection(file, "copy" + std::to_string(i), mayUse, {});
            EXPECT_TRUE(done) << done.error().message;
        });
    }
    for (std::thread& thread : importing) thread.join();
    expectBoth(
        [&](const Content& content) { return has(content, "copy0", 100) && has(content, "copy1", 100); },
        "two copies");
}

TEST_F(SharedDatabaseTest, JobsOfAServerThatHasDiedGoToAnother) {
    for (const auto& server : servers_) EXPECT_TRUE(server->stop());
    servers_.clear();
    auto dying = openStore("dying", 600ms);
    const auto collection = dying->getCollection("default").value();
    ASSERT_TRUE(dying->putShape(putRequest(collection.id, "cup", taggedPoints(5.0f))));
    const auto claimed = dying->claimJob().value();
    ASSERT_TRUE(claimed);
    auto other = openStore("other", 600ms);
    EXPECT_FALSE(other->claimJob().value()) << "it is in hand";
    std::this_thread::sleep_for(1'200ms);
    EXPECT_FALSE(other->claimJob().value()) << "its worker lives and renews its claim";
    dying.reset();
    std::optional<store::Job> taken;
    ASSERT_TRUE(eventually([&] { return (taken = other->claimJob().value()).has_value(); }));
    EXPECT_EQ(taken->id, claimed->id);
    EXPECT_EQ(taken->attempts, 1) << "nobody says that the scan was the reason";
    EXPECT_EQ(taken->stops, 1);
}

// Two servers, each change sent to any of them, against one with a database in a file.
TEST_F(SharedDatabaseTest, AnswersAsOneServerWithADatabaseOfItsOwn) {
    store::SqliteOptions options;
    options.path = folder_.file("alone.db");
    const auto alone = start(std::move(store::openSqliteStore(options).value()));
    for (int seed = 1; seed <= testScale(); ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        for (int step = 0; step < 120; ++step) {
            const std::string key = "k" + std::to_string(random.below(10));
            const auto tag = static_cast<float>(1 + random.below(40));
            const Metadata metadata = {{"n", std::to_string(random.below(3))}};
            const auto what = random.below(10);
            const auto change = [&](Catalog& server) -> std::string {
                if (what < 6) {
                    const auto added = put(server, key, tag, metadata);
                    return added ? std::to_string(static_cast<int>(added->outcome)) : added.error().message;
                }
                if (what < 9) {
                    const auto deleted = server.deleteShape("", key, std::nullopt);
                    return deleted ? "deleted" : deleted.error().message;
                }
                const auto exists = server.collection("c" + key);
                const auto done = exists ? server.deleteCollection("c" + key, true) : Result<void>();
                if (exists) return done ? "gone" : done.error().message;
                const auto made = server.createCollection("c" + key, "", parametersOf(Profile::kDefault));
                return made ? "made" : made.error().message;
            };
            Catalog& any = *servers_[random.below(2)];
            // A collection is looked up in the index of the server that is asked.
            if (what == 9) {
                ASSERT_TRUE(eventually([&] { return contentOf(any).size() == contentOf(*alone).size(); }));
            }
            EXPECT_EQ(change(any), change(*alone)) << "seed " << seed << " step " << step << " " << key;
        }
        const auto quiet = [](Catalog& server) { return server.stats().value().queue.jobs == 0; };
        ASSERT_TRUE(eventually([&] { return quiet(*alone) && quiet(*servers_[0]); }));
        const Content expected = contentOf(*alone);
        expectBoth([&](const Content& content) { return content == expected; }, "the same content");
        for (const auto& server : servers_) {
            for (int volume = 1; volume < 40; volume += 7) {
                std::vector<std::string> answers;
                for (Catalog* asked : {alone.get(), server.get()}) {
                    const auto snapshot = asked->collection("").value();
                    std::string answer;
                    SearchOptions search;
                    search.k = 5;
                    const auto found = topK(signatureOf(volume), snapshot->signatures, search, {}).value();
                    for (const SearchHit& hit : found.hits) {
                        const auto place = snapshot->signatures.find(hit.id);
                        answer +=
                            std::string(place.block->key(place.row)) + " " + std::to_string(hit.score) + "\n";
                    }
                    answers.push_back(answer);
                }
                EXPECT_EQ(answers[1], answers[0]);
            }
        }
    }
    EXPECT_TRUE(alone->stop());
}

}  // namespace
}  // namespace shapedb::catalog
