// SPDX-License-Identifier: GPL-3.0-or-later
// Servers that hold parts of the signatures go on while one of them is killed, stopped or started again.
#include <algorithm>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/store/postgres/connection.h"
#include "tests/integration/support/cluster_fixture.h"

namespace shapedb::testing {
namespace {

using ClusterFaultsTest = ClusterTest;

TEST_F(ClusterFaultsTest, WithTwoReplicasAKilledServerIsNotMissed) {
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

TEST_F(ClusterFaultsTest, WithOneReplicaAKilledServerIsMissedForALease) {
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

TEST_F(ClusterFaultsTest, AServerThatIsStoppedAnswersNothingOldWhenItGoesOn) {
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

TEST_F(ClusterFaultsTest, WhileSignaturesOfARebuildAreReadSearchesWait) {
    start(1);
    fill(5);
    const auto before = searchByKey(client("one"), "k1", searchOptions(kThings, 20));
    ASSERT_TRUE(before.ok()) << before;
    pb::SearchBySignatureRequest request;
    *request.mutable_options() = searchOptions(kThings, 20);
    request.mutable_options()->set_no_explanation(true);
    request.set_signature(before.value.query().encoded());

    // A rebuild is put in place, whose signatures take 8 s to be read.
    const store::StatementTexts none;
    store::PostgresConnection slow({uri_, {}, 60s, "slow"}, none);
    store::PostgresConnection rebuild({uri_, {}, 60s, "rebuild"}, none);
    rebuild.execute(
        "BEGIN; UPDATE signature SET generation = 2; WITH next AS (UPDATE collection SET generation = 2, "
        "last_change = last_change + 1 WHERE name "
        "= 'things' RETURNING id, last_change) INSERT INTO change (collection_id, number) SELECT id, "
        "last_change FROM next");
    std::thread done([&] {
        slow.execute("BEGIN; LOCK TABLE signature");  // waits for the commit, before all who want to read
        std::this_thread::sleep_for(8s);
        slow.execute("COMMIT");
    });
    EXPECT_TRUE(
        eventually([&] { return rebuild.text("SELECT count(*) FROM pg_locks WHERE NOT granted") != "0"; }));
    rebuild.execute("COMMIT");
    for (const char* name : {"one", "two", "three"}) {
        const auto found =
            unary(*client(name).searches, &pb::SearchService::Stub::SearchBySignature, request, 30s);
        EXPECT_TRUE(found.ok()) << name << ": " << found;
        EXPECT_EQ(found.value.hits_size(), 5);
    }
    done.join();
}

TEST_F(ClusterFaultsTest, ARollingRestartFailsNoSearch) {
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

}  // namespace
}  // namespace shapedb::testing
