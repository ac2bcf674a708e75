// SPDX-License-Identifier: GPL-3.0-or-later
// What calls say of several servers with one database, and copies from one server to another.
#include <gtest/gtest.h>

#include "client/api/client.h"
#include "tests/client/api/fake_server.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::client {
namespace {

TEST(SeveralServers, ChangesOfShapesAreTold) {
    FakeServer server;
    const Client client = server.client();
    EXPECT_EQ(client.getShape({"", "a"})->change, 0) << "the server has the database alone";
    server.shapes.change = 12;
    EXPECT_EQ(client.getShape({"", "a"})->change, 12);
    EXPECT_EQ(client.deleteShape({"", "a"})->change, 12);
    EXPECT_EQ(client.addShape({{"", "a"}}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}})->shape.change, 12);
}

TEST(SeveralServers, SearchesDemandChangesAndAllowGaps) {
    FakeServer server;
    server.search.answer.set_covered(0.75);
    server.search.answer.set_candidates(6);
    SearchOptions options;
    EXPECT_EQ(server.client().searchByKey(options, "a")->covered, 1.0) << "nobody allowed less";
    EXPECT_EQ(server.search.options.at_least(), 0);
    EXPECT_FALSE(server.search.options.allow_partial());
    options.atLeast = 12;
    options.allowPartial = true;
    EXPECT_EQ(server.client().searchByKey(options, "a")->covered, 0.75);
    EXPECT_EQ(server.search.options.at_least(), 12);
    EXPECT_TRUE(server.search.options.allow_partial());
    EXPECT_EQ(server.client().searchBatch(options, {{"a", {}}})->front().covered, 0.75);
    server.search.answer.clear_covered();
    EXPECT_EQ(server.client().searchByKey(options, "a")->covered, 1.0) << "an older server";
    server.search.answer.clear_candidates();
    EXPECT_EQ(server.client().searchByKey(options, "a")->covered, 0.0);
}

TEST(SeveralServers, TheCommandTellsAGapInWordsAndJson) {
    FakeServer server;
    server.search.answer.set_covered(0.75);
    server.search.answer.set_candidates(6);
    const std::vector<std::string> query = {"query",          "--key",      "a", "--server",
                                            server.address(), "--at-least", "7", "--allow-partial"};
    const cli::CommandRun text = cli::runCommand(query);
    EXPECT_EQ(text.exitCode, 0) << text.err;
    EXPECT_NE(text.out.find("only 75 % of the collection searched"), std::string::npos) << text.out;
    EXPECT_EQ(server.search.options.at_least(), 7);
    std::vector<std::string> asJson = query;
    asJson.emplace_back("--json");
    EXPECT_EQ(cli::runCommand(asJson).json()["covered"], 0.75);
    server.search.answer.set_covered(1.0);
    EXPECT_EQ(cli::runCommand(query).out.find("only"), std::string::npos);
    EXPECT_EQ(cli::runCommand({"query", "--key", "a", "--at-least", "-1"}).exitCode, 2);
}

TEST(SeveralServers, TheCommandTellsChangesThatThereAre) {
    FakeServer server;
    const std::vector<std::string> get = {"get", "a", "--server", server.address(), "--json"};
    EXPECT_EQ(cli::runCommand(get).json().count("change"), 0u);
    server.shapes.change = 12;
    EXPECT_EQ(cli::runCommand(get).json()["change"], 12);
    const nlohmann::json deleted =
        cli::runCommand({"delete", "a", "--server", server.address(), "--json"}).json();
    EXPECT_EQ(deleted["deleted"][0]["change"], 12);
}

v1::BackupChunk chunkOf(const std::string& data) {
    v1::BackupChunk chunk;
    chunk.set_data(data);
    return chunk;
}

/// Three chunks, as a server sends them.
std::vector<v1::BackupChunk> backupChunks() {
    std::vector<v1::BackupChunk> chunks = {chunkOf("one"), chunkOf("two"), chunkOf("six")};
    chunks.front().set_total_bytes(9);
    chunks.back().set_sha256("checked by the other server");
    return chunks;
}

TEST(CopyEverything, HandsTheBackupOnAsItComes) {
    FakeServer from;
    FakeServer to;
    from.admin.backup = backupChunks();
    std::uint64_t copied = 0;
    RunContext context;
    context.progress = [&](const char*, std::uint64_t done, std::uint64_t) { copied = done; };
    const auto report = from.client().copyEverything(to.client(), context);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->shapes, 3u);
    EXPECT_EQ(copied, 9u);
    ASSERT_EQ(to.admin.restored.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(to.admin.restored[i].SerializeAsString(), from.admin.backup[i].SerializeAsString());
    }
}

TEST(CopyEverything, ThatLosesItsBackupIsNotCompleted) {
    FakeServer from;
    FakeServer to;
    from.admin.backup = backupChunks();
    from.admin.backup.pop_back();
    from.admin.backupStatus = {grpc::StatusCode::DATA_LOSS, "a page cannot be read"};
    const auto report = from.client().copyEverything(to.client());
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().message, "a page cannot be read");
    from.admin.backup.clear();
    EXPECT_EQ(from.client().copyEverything(to.client()).error().message, "a page cannot be read");
    from.admin.backupStatus = grpc::Status::OK;
    EXPECT_EQ(from.client().copyEverything(to.client()).error().code, ErrorCode::kCountMismatch);
}

TEST(CopyEverything, SaysWhyTheOtherServerRefuses) {
    FakeServer from;
    FakeServer to;
    from.admin.backup = backupChunks();
    to.admin.restoreStatus = {grpc::StatusCode::RESOURCE_EXHAUSTED, "the disk is full"};
    EXPECT_NE(from.client().copyEverything(to.client()).error().message.find("the disk is full"),
              std::string::npos);
    to.admin.restoreTakes = 1;
    EXPECT_NE(from.client().copyEverything(to.client()).error().message.find("the disk is full"),
              std::string::npos);
}

}  // namespace
}  // namespace shapedb::client
