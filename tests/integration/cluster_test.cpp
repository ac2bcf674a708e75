// SPDX-License-Identifier: GPL-3.0-or-later
// Three servers on one PostgreSQL database, each with a part of the signatures: their answers are those of
// one server with SQLite, and they go on while one of them is killed, stopped or started again.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/integration/support/client.h"
#include "tests/integration/support/server_process.h"
#include "tests/server/support/postgres_cluster.h"
#include "tests/support/scale.h"
#include "tests/support/self_signed.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* kThings = "things";
constexpr std::chrono::milliseconds kLease{1'000};

/// Without what differs between two runs of the same search.
pb::SearchResponse comparable(pb::SearchResponse response) {
    response.clear_seconds_segment();
    response.clear_seconds_search();
    response.clear_scored();
    response.clear_report();
    for (pb::Hit& hit : *response.mutable_hits()) {
        hit.mutable_shape()->clear_created();
        hit.mutable_shape()->clear_updated();
    }
    return response;
}

std::string textOf(const Outcome& outcome, const pb::SearchResponse& response) {
    return outcome.ok() ? comparable(response).DebugString()
                        : outcome.error + ": " + outcome.status.error_message();
}

class ClusterTest : public ::testing::Test {
  protected:
    void SetUp() override {
        SHAPEDB_USE_POSTGRES(postgres_);
        uri_ = postgres_->createDatabase();
    }

    void start(int replicas, const std::vector<std::string>& names = {"one", "two", "three"}) {
        replicas_ = replicas;
        for (const std::string& name : names) startServer(name);
        ASSERT_TRUE(eventually([&] { return everySearchIsAnswered(); })) << "shards without a server";
    }

    void startServer(const std::string& name, const std::vector<std::string>& more = {}) {
        std::vector<std::string> flags = {"--store-engine",
                                          "postgres",
                                          "--postgres-uri",
                                          uri_,
                                          "--postgres-server-name",
                                          name,
                                          "--postgres-job-lease-seconds",
                                          "2",
                                          "--cluster-replicas",
                                          std::to_string(replicas_),
                                          "--cluster-lease-milliseconds",
                                          std::to_string(kLease.count())};
        flags.insert(flags.end(), more.begin(), more.end());
        servers_[name] = std::make_unique<ServerProcess>(folder_.file(name), flags);
        clients_[name] = std::make_unique<Client>(servers_[name]->address());
    }

    bool everySearchIsAnswered() {
        for (const auto& [name, client] : clients_) {
            grpc::health::v1::HealthCheckRequest request;
            request.set_service("shapedb.v1.SearchService");
            const auto reply = unary(*client->health, &grpc::health::v1::Health::Stub::Check, request);
            if (reply.value.status() != grpc::health::v1::HealthCheckResponse::SERVING) return false;
        }
        return true;
    }

    Client& any(Random& random) {
        auto chosen = clients_.begin();
        std::advance(chosen, static_cast<std::ptrdiff_t>(random.below(clients_.size())));
        return *chosen->second;
    }
    Client& client(const std::string& name) { return *clients_.at(name); }

    static Reply<pb::SearchResponse> searchByKey(Client& client, const std::string& key,
                                                 const pb::SearchOptions& options,
                                                 std::chrono::milliseconds timeout = 60s) {
        pb::SearchByKeyRequest request;
        *request.mutable_options() = options;
        request.set_key(key);
        request.set_include_self(true);
        return unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request, timeout);
    }

    /// Whether the server has heard of the collection, soon.
    static bool knows(Client& client) {
        pb::GetCollectionRequest request;
        request.set_name(kThings);
        return eventually([&] {
            return unary(*client.collections, &pb::CollectionService::Stub::GetCollection, request).ok();
        });
    }

    /// Stores `count` scans by the first server.
    void fill(int count) {
        Client& first = *clients_.begin()->second;
        ASSERT_TRUE(createCollection(first, kThings, pb::PROFILE_DEFAULT).ok());
        for (int i = 0; i < count; ++i) {
            const auto added = addAndWait(first, kThings, "k" + std::to_string(i),
                                          familyScan("mug", static_cast<std::size_t>(i), 1, 800));
            ASSERT_TRUE(added.ok()) << added;
        }
        for (const auto& [name, one] : clients_) ASSERT_TRUE(knows(*one)) << name;
    }

    /// Searches again and again by these servers until it is destroyed.
    class Load {
      public:
        Load(ClusterTest& test, std::vector<std::string> names) {
            for (const std::string& name : names) {
                threads_.emplace_back([this, &client = test.client(name)] {
                    while (!over_) {
                        const auto found = searchByKey(client, "k1", searchOptions(kThings, 20), 20s);
                        const auto now = Clock::now();
                        if (found.ok() && found.value.hits_size() > 0) {
                            ++answered;
                            continue;
                        }
                        ++failed;
                        const std::lock_guard<std::mutex> lock(mutex_);
                        lastFailure_ = now;
                        what_ = found.status.error_message();
                        std::this_thread::sleep_for(20ms);
                    }
                });
            }
        }
        ~Load() {
            over_ = true;
            for (std::thread& thread : threads_) thread.join();
        }
        Clock::time_point lastFailure() const {
            const std::lock_guard<std::mutex> lock(mutex_);
            return lastFailure_;
        }
        std::string what() const {
            const std::lock_guard<std::mutex> lock(mutex_);
            return what_;
        }
        std::atomic<int> answered{0};
        std::atomic<int> failed{0};

      private:
        std::atomic<bool> over_{false};
        mutable std::mutex mutex_;
        Clock::time_point lastFailure_{};
        std::string what_;
        std::vector<std::thread> threads_;
    };

    TemporaryDirectory folder_;
    PostgresCluster* postgres_ = nullptr;
    std::string uri_;
    int replicas_ = 1;
    std::map<std::string, std::unique_ptr<ServerProcess>> servers_;
    std::map<std::string, std::unique_ptr<Client>> clients_;
};

/// The same random history of writes and searches for one server and for three.
class TwoHistories {
  public:
    TwoHistories(Client& alone, std::function<Client&()> any, std::uint64_t seed)
        : alone_(alone), any_(std::move(any)), random_(seed) {}

    void step() {
        const auto choice = random_.below(20);
        if (keys_.size() < 5 || choice < 5) return add();
        if (choice == 5) return remove();
        if (choice == 6) return rebuild();
        if (choice == 7) return searchBatch();
        if (choice == 8) return searchBySignature();
        if (choice == 9) return searchScan();
        if (choice == 10) return compareTwo();
        if (choice == 11) return list();
        search();
    }

  private:
    std::string anyKey() {
        auto chosen = keys_.begin();
        std::advance(chosen, static_cast<std::ptrdiff_t>(random_.below(keys_.size())));
        return chosen->first;
    }
    Scan anyScan() {
        static constexpr const char* kFamilies[] = {"mug", "hammer", "animal", "table", "airplane"};
        return familyScan(kFamilies[random_.below(5)], random_.below(4), 1 + random_.below(3), 700);
    }

    void add() {
        const std::string key = "k" + std::to_string(random_.below(40));
        const Scan scan = anyScan();
        std::map<std::string, std::string> metadata;
        if (random_.below(4) > 0)
            metadata["label"] = std::string(1, static_cast<char>('a' + random_.below(3)));
        const auto one = addAndWait(alone_, kThings, key, scan, metadata);
        const auto three = addAndWait(any_(), kThings, key, scan, metadata);
        ASSERT_EQ(three.ok(), one.ok()) << three << one;
        EXPECT_EQ(three.value.outcome(), one.value.outcome());
        EXPECT_EQ(three.value.shape().version(), one.value.shape().version());
        EXPECT_EQ(three.value.shape().quality(), one.value.shape().quality());
        if (one.ok()) keys_[key] = true;
    }

    void remove() {
        pb::DeleteShapeRequest request;
        request.mutable_shape()->set_collection(kThings);
        request.mutable_shape()->set_key(anyKey());
        const auto one = unary(*alone_.shapes, &pb::ShapeService::Stub::DeleteShape, request);
        const auto three = unary(*any_().shapes, &pb::ShapeService::Stub::DeleteShape, request);
        EXPECT_EQ(three.ok(), one.ok()) << three << one;
        EXPECT_EQ(three.value.shape().quality(), one.value.shape().quality());
        keys_.erase(request.shape().key());
    }

    void rebuild() {
        pb::RebuildRequest request;
        request.set_collection(kThings);
        request.mutable_segmentation()->set_thinning(0.8 + 0.2 * static_cast<double>(random_.below(3)));
        for (Client* client : {&alone_, &any_()}) {
            CallContext context;
            const auto reader = client->admin->Rebuild(&context, request);
            const auto told = drain(context, *reader);
            ASSERT_TRUE(told.ok()) << told;
        }
    }

    pb::SearchOptions anyOptions() {
        pb::SearchOptions options = searchOptions(kThings, 1 + static_cast<std::uint32_t>(random_.below(15)));
        if (random_.below(4) == 0) options.set_threshold(0.4);
        if (random_.below(4) == 0) options.set_filter("label!=b");
        options.set_forbid_reflection(random_.below(3) == 0);
        options.set_keep_scale(random_.below(4) == 0);
        options.set_partial(random_.below(5) == 0);
        options.set_no_explanation(random_.below(4) == 0);
        if (random_.below(3) == 0) options.set_verify(random_.below(2) == 0);
        if (random_.below(3) == 0)
            options.set_verify_candidates(1 + static_cast<std::uint32_t>(random_.below(20)));
        if (random_.below(4) == 0) options.set_one_sided(random_.below(2) == 0);
        if (random_.below(3) == 0) {
            options.set_group_by("label");
            options.set_per_group(static_cast<std::uint32_t>(random_.below(3)));
        }
        return options;
    }

    void expectSame(const Reply<pb::SearchResponse>& three, const Reply<pb::SearchResponse>& one) {
        ++searches;
        EXPECT_EQ(textOf(three, three.value), textOf(one, one.value));
    }

    void search() {
        pb::SearchByKeyRequest request;
        *request.mutable_options() = anyOptions();
        request.set_key(random_.below(12) == 0 ? "nothing" : anyKey());
        request.set_include_self(random_.below(2) == 0);
        const auto by = [&](Client& client) {
            return unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request);
        };
        expectSame(by(any_()), by(alone_));
    }

    void searchBySignature() {
        pb::SearchByKeyRequest source;
        *source.mutable_options() = searchOptions(kThings, 1);
        source.set_key(anyKey());
        const auto found = unary(*alone_.searches, &pb::SearchService::Stub::SearchByKey, source);
        pb::SearchBySignatureRequest request;
        *request.mutable_options() = anyOptions();
        request.mutable_options()->clear_verify();
        request.set_signature(found.value.query().encoded());
        const auto by = [&](Client& client) {
            return unary(*client.searches, &pb::SearchService::Stub::SearchBySignature, request);
        };
        expectSame(by(any_()), by(alone_));
    }

    void searchBatch() {
        pb::SearchBatchRequest request;
        *request.mutable_options() = anyOptions();
        for (int i = 0; i < 6; ++i) request.add_queries()->set_key(anyKey());
        const auto by = [&](Client& client) {
            return unary(*client.searches, &pb::SearchService::Stub::SearchBatch, request);
        };
        const auto three = by(any_());
        const auto one = by(alone_);
        ASSERT_EQ(three.ok(), one.ok()) << three << one;
        ASSERT_EQ(three.value.responses_size(), one.value.responses_size());
        for (int i = 0; i < one.value.responses_size(); ++i) {
            ++searches;
            EXPECT_EQ(comparable(three.value.responses(i)).DebugString(),
                      comparable(one.value.responses(i)).DebugString());
        }
    }

    void searchScan() {
        const pb::SearchOptions options = anyOptions();
        const Scan scan = anyScan();
        expectSame(searchByScan(any_(), options, scan), searchByScan(alone_, options, scan));
    }

    void compareTwo() {
        pb::CompareRequest request;
        for (pb::ShapeRef* ref : {request.mutable_query(), request.mutable_other()}) {
            ref->set_collection(kThings);
            ref->set_key(anyKey());
        }
        const auto three = unary(*any_().searches, &pb::SearchService::Stub::Compare, request);
        const auto one = unary(*alone_.searches, &pb::SearchService::Stub::Compare, request);
        EXPECT_EQ(three.value.DebugString(), one.value.DebugString());
    }

    void list() {
        const auto three = listAll(any_(), kThings);
        const auto one = listAll(alone_, kThings);
        ASSERT_EQ(three.size(), one.size());
        for (std::size_t i = 0; i < one.size(); ++i) {
            EXPECT_EQ(three[i].key(), one[i].key());
            EXPECT_EQ(three[i].quality(), one[i].quality()) << one[i].key();
        }
    }

    Client& alone_;
    std::function<Client&()> any_;
    Random random_;
    std::map<std::string, bool> keys_;

  public:
    int searches = 0;
};

TEST_F(ClusterTest, AnswersAreThoseOfOneServerWithSqlite) {
    start(1);
    ServerProcess alone(folder_.file("alone"));
    Client aloneClient(alone.address());
    ASSERT_TRUE(createCollection(aloneClient, kThings, pb::PROFILE_DEFAULT).ok());
    ASSERT_TRUE(createCollection(client("two"), kThings, pb::PROFILE_DEFAULT).ok());
    for (const auto& [name, one] : clients_) ASSERT_TRUE(knows(*one)) << name;
    Random servers(5);
    TwoHistories histories(
        aloneClient, [&]() -> Client& { return any(servers); }, 7);
    for (int i = 0; i < 60 * testScale() && !HasFatalFailure() && !HasNonfatalFailure(); ++i) {
        SCOPED_TRACE(i);
        histories.step();
    }
    EXPECT_GT(histories.searches, 20);
}

TEST_F(ClusterTest, WithTwoReplicasAKilledServerIsNotMissed) {
    start(2);
    fill(6);
    Load load(*this, {"one", "two"});
    ASSERT_TRUE(eventually([&] { return load.answered > 10; }));
    servers_.at("three")->kill();
    clients_.erase("three");
    std::this_thread::sleep_for(2 * kLease);
    EXPECT_EQ(load.failed, 0) << load.what();
    EXPECT_GT(load.answered, 20);
}

TEST_F(ClusterTest, WithOneReplicaAKilledServerIsMissedForALease) {
    start(1);
    fill(6);
    Load load(*this, {"one", "two"});
    ASSERT_TRUE(eventually([&] { return load.answered > 10; }));
    servers_.at("three")->kill();
    const auto killed = Clock::now();
    clients_.erase("three");
    std::this_thread::sleep_for(4 * kLease);
    // The patience of a search itself comes on top.
    EXPECT_LT(load.lastFailure(), killed + kLease + 2s) << load.what();
    const int before = load.answered;
    ASSERT_TRUE(eventually([&] { return load.answered > before + 10; }));
}

TEST_F(ClusterTest, AServerThatIsStoppedAnswersNothingOldWhenItGoesOn) {
    start(1);
    fill(4);
    servers_.at("three")->signal(SIGSTOP);
    // Once the others have its part, a shape is deleted.
    ASSERT_TRUE(
        eventually([&] { return searchByKey(client("one"), "k1", searchOptions(kThings, 20), 5s).ok(); }));
    pb::DeleteShapeRequest request;
    request.mutable_shape()->set_collection(kThings);
    request.mutable_shape()->set_key("k2");
    ASSERT_TRUE(unary(*client("one").shapes, &pb::ShapeService::Stub::DeleteShape, request).ok());
    servers_.at("three")->signal(SIGCONT);
    for (int i = 0; i < 20; ++i) {
        const auto found =
            searchByKey(client(i % 2 == 0 ? "three" : "one"), "k1", searchOptions(kThings, 20));
        if (!found.ok()) continue;  // while shards change hands
        EXPECT_EQ(found.value.hits_size(), 3) << i;
        EXPECT_EQ(found.value.candidates(), 3u) << i;
    }
}

TEST_F(ClusterTest, ARollingRestartFailsNoSearch) {
    start(2);
    fill(6);
    std::vector<std::string> names = {"one", "two", "three"};
    for (const std::string& name : names) {
        std::vector<std::string> others = names;
        others.erase(std::find(others.begin(), others.end(), name));
        Load load(*this, others);
        ASSERT_TRUE(eventually([&] { return load.answered > 5; }));
        servers_.at(name)->signal(SIGTERM);
        EXPECT_EQ(servers_.at(name)->wait(), 0);
        startServer(name);
        ASSERT_TRUE(eventually([&] { return everySearchIsAnswered(); }));
        EXPECT_EQ(load.failed, 0) << load.what();
    }
}

TEST_F(ClusterTest, WhoHasWrittenFindsItOnAnyServer) {
    replicas_ = 0;  // every server holds all, and hears of changes a little later
    for (const char* name : {"one", "two"}) startServer(name);
    ASSERT_TRUE(createCollection(client("one"), kThings, pb::PROFILE_DEFAULT).ok());
    ASSERT_TRUE(knows(client("two")));
    for (int i = 0; i < 10; ++i) {
        const std::string key = "k" + std::to_string(i);
        const auto added = addAndWait(client("one"), kThings, key, familyScan("mug", std::size_t(i), 1, 700));
        ASSERT_TRUE(added.ok()) << added;
        ASSERT_GT(added.value.change(), 0);
        pb::SearchOptions options = searchOptions(kThings, 20);
        options.set_at_least(added.value.change());
        const auto found = searchByKey(client("two"), key, options);
        ASSERT_TRUE(found.ok()) << found;
        EXPECT_EQ(found.value.hits_size(), i + 1);
    }
    pb::SearchOptions future = searchOptions(kThings);
    future.set_at_least(1'000'000);
    EXPECT_EQ(searchByKey(client("two"), "k1", future).status.error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(ClusterTest, RolesShareTheWork) {
    replicas_ = 1;
    startServer("front", {"--role", "serve"});
    const auto created = createCollection(client("front"), kThings, pb::PROFILE_DEFAULT);
    ASSERT_TRUE(created.ok()) << created;
    const Scan scan = familyScan("mug", 1, 1, 700);
    ASSERT_TRUE(addShape(client("front"), headerFor(kThings, "k1", scan), scan).ok());
    std::this_thread::sleep_for(500ms);
    EXPECT_EQ(getShape(client("front"), kThings, "k1").value.state(), pb::SHAPE_STATE_PENDING);
    startServer("worker", {"--role", "worker"});
    ASSERT_TRUE(eventually(
        [&] { return getShape(client("front"), kThings, "k1").value.state() == pb::SHAPE_STATE_READY; }));
    const auto found = searchByKey(client("front"), "k1", searchOptions(kThings));
    EXPECT_EQ(found.value.hits_size(), 1) << found;
    const auto refused = searchByKey(client("worker"), "k1", searchOptions(kThings));
    EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::UNAVAILABLE) << refused;
}

TEST_F(ClusterTest, ServersShowEachOtherTheirCertificates) {
    const PemPair pair = selfSigned("localhost");
    const auto write = [&](const char* name, const std::string& text) {
        std::ofstream(folder_.file(name)) << text;
        return folder_.file(name);
    };
    const std::string certificate = write("c.pem", pair.certificate);
    const std::vector<std::string> tls = {"--cluster-certificate",  certificate,    "--cluster-key",
                                          write("k.pem", pair.key), "--cluster-ca", certificate,
                                          "--cluster-advertise",    "localhost"};
    for (const char* name : {"one", "two"}) startServer(name, tls);
    ASSERT_TRUE(eventually([&] { return everySearchIsAnswered(); }));
    fill(6);
    EXPECT_EQ(searchByKey(client("one"), "k1", searchOptions(kThings, 20)).value.hits_size(), 6);
    EXPECT_EQ(searchByKey(client("two"), "k1", searchOptions(kThings, 20)).value.hits_size(), 6);
    // The others do not answer one without a certificate.
    startServer("stranger", {"--cluster-advertise", "localhost"});
    const auto found = searchByKey(client("stranger"), "k1", searchOptions(kThings, 20), 5s);
    EXPECT_EQ(found.status.error_code(), grpc::StatusCode::UNAVAILABLE) << found;
}

TEST_F(ClusterTest, AnAnswerOfSomeShardsSaysSo) {
    start(1);
    fill(6);
    servers_.at("three")->signal(SIGSTOP);
    pb::SearchOptions options = searchOptions(kThings, 20);
    options.set_allow_partial(true);
    const auto found = searchByKey(client("one"), "k1", options);
    servers_.at("three")->signal(SIGCONT);
    ASSERT_TRUE(found.ok()) << found;
    EXPECT_GT(found.value.covered(), 0.3);
    EXPECT_LE(found.value.covered(), 1.0);
}

}  // namespace
}  // namespace shapedb::testing
