// SPDX-License-Identifier: GPL-3.0-or-later
// Three servers on one PostgreSQL database, each with a part of the signatures: their answers are those of
// one server with SQLite.
#include <chrono>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/integration/support/cluster_fixture.h"
#include "tests/support/scale.h"
#include "tests/support/self_signed.h"

namespace shapedb::testing {
namespace {

/// Without what differs between two runs of the same search, and `scored`: how many rows the bounds left to
/// be scored in full depends on how the collection is divided, as it does on the number of threads.
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
        if (choice == 12) return relabel();
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

    void relabel() {
        pb::UpdateMetadataRequest request;
        request.set_collection(kThings);
        request.set_key(anyKey());
        (*request.mutable_change()->mutable_set())["label"] =
            std::string(1, static_cast<char>('a' + random_.below(3)));
        const auto one = unary(*alone_.shapes, &pb::ShapeService::Stub::UpdateMetadata, request);
        const auto three = unary(*any_().shapes, &pb::ShapeService::Stub::UpdateMetadata, request);
        EXPECT_EQ(three.ok(), one.ok()) << three << one;
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
        if (random_.below(5) == 0) options.set_free_scale(!options.keep_scale());
        if (random_.below(5) == 0) options.mutable_viewpoint()->set_z(3.0);
        if (random_.below(5) == 0) options.set_at_least(1 + static_cast<std::int64_t>(random_.below(5)));
        options.set_allow_partial(random_.below(5) == 0);
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
    for (int i = 0; i < 80 * testScale() && !HasFatalFailure() && !HasNonfatalFailure(); ++i) {
        SCOPED_TRACE(i);
        histories.step();
    }
    EXPECT_GT(histories.searches, 20);
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
