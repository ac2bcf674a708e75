// SPDX-License-Identifier: GPL-3.0-or-later
// ExportCollection and ImportCollection on live servers.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "common/sha256.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;
using Chunks = std::vector<pb::BackupChunk>;

Stream<pb::BackupChunk> exportCollection(Client& client, const std::string& name) {
    CallContext context;
    pb::ExportCollectionRequest request;
    request.set_collection(name);
    const auto reader = client.admin->ExportCollection(&context, request);
    return testing::drain(context, *reader);
}

Reply<pb::ImportCollectionResponse> send(Client& client,
                                         const std::vector<pb::ImportCollectionRequest>& messages) {
    CallContext context;
    Reply<pb::ImportCollectionResponse> reply;
    const auto writer = client.admin->ImportCollection(&context, &reply.value);
    for (const auto& message : messages) {
        if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    static_cast<Outcome&>(reply) = context.outcome(writer->Finish());
    return reply;
}

std::vector<pb::ImportCollectionRequest> messagesOf(const std::string& name, const Chunks& chunks) {
    std::vector<pb::ImportCollectionRequest> messages(1);
    messages[0].mutable_header()->set_collection(name);
    for (const pb::BackupChunk& chunk : chunks) *messages.emplace_back().mutable_chunk() = chunk;
    return messages;
}

Reply<pb::ImportCollectionResponse> importCollection(Client& client, const std::string& name,
                                                     const Chunks& chunks) {
    return send(client, messagesOf(name, chunks));
}

Chunks chunksOfText(const std::string& text) {
    const auto digest = sha256(text.data(), text.size());
    Chunks chunks(2);
    chunks[0].set_total_bytes(text.size());
    chunks[0].set_data(text);
    chunks[1].set_sha256(digest.data(), digest.size());
    return chunks;
}

/// Keys and scores of the hits, to the last bit.
std::vector<std::string> hitsOf(const Reply<pb::SearchResponse>& reply) {
    EXPECT_TRUE(reply.ok()) << reply;
    std::vector<std::string> hits;
    for (const pb::Hit& hit : reply.value.hits()) {
        std::string text = hit.shape().key();
        for (const double score : {hit.score(), hit.signature_score()}) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &score, sizeof bits);
            text += " " + std::to_string(bits);
        }
        hits.push_back(text);
    }
    return hits;
}

std::vector<std::string> hitsByKey(Client& client, const std::string& collection, const std::string& key,
                                   bool partial) {
    pb::SearchByKeyRequest request;
    *request.mutable_options() = searchOptions(collection, 20);
    request.mutable_options()->set_partial(partial);
    request.mutable_options()->set_filter("set = a");
    request.set_key(key);
    request.set_include_self(true);
    return hitsOf(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request));
}

class TransferRpc : public LiveTest {
  protected:
    TransferRpc() : name_(collection + "-kept") {}

    /// A collection of the default profile, whose searches verify; two shapes are equal but for their keys.
    void fill() {
        ASSERT_TRUE(createCollection(client, name_, pb::PROFILE_DEFAULT).ok());
        for (int i = 0; i < 6; ++i) {
            const auto seed = static_cast<std::uint64_t>(i == 4 ? 2 : i + 1);
            const auto added = addAndWait(client, name_, "k" + std::to_string(9 - i), dumbbell(seed, 1'000),
                                          {{"set", i == 0 ? "b" : "a"}});
            ASSERT_TRUE(added.ok()) << added;
        }
    }

    void expectSameHits(Client& other, const std::string& copy) {
        for (int i = 0; i < 6; ++i) {
            const std::string key = "k" + std::to_string(9 - i);
            const bool partial = i == 5;
            const auto hits = hitsByKey(client, name_, key, partial);
            EXPECT_EQ(hits.size(), 5u);
            EXPECT_EQ(hitsByKey(other, copy, key, partial), hits) << key;
        }
        const Scan query = dumbbell(77, 1'000);
        const auto hits = hitsOf(searchByScan(client, searchOptions(name_, 20), query));
        EXPECT_EQ(hits.size(), 6u);
        EXPECT_EQ(hitsOf(searchByScan(other, searchOptions(copy, 20), query)), hits);
    }

    bool exists(const std::string& name) {
        pb::GetCollectionRequest request;
        request.set_name(name);
        return unary(*client.collections, &pb::CollectionService::Stub::GetCollection, request).ok();
    }

    const std::string name_;
};

TEST_F(TransferRpc, AnImportedCollectionGivesTheSameHits) {
    fill();
    const auto saved = exportCollection(client, name_);
    ASSERT_TRUE(saved.ok()) << saved;
    std::string all;
    for (const auto& chunk : saved.messages) all += chunk.data();
    EXPECT_EQ(saved.messages.front().total_bytes(), all.size());
    EXPECT_EQ(all.rfind("SQLite format 3", 0), 0u);

    // Beside the original, and on another server whose ids are others.
    const auto beside = importCollection(client, name_ + "-copy", saved.messages);
    ASSERT_TRUE(beside.ok()) << beside;
    EXPECT_EQ(beside.value.collection(), name_ + "-copy");
    EXPECT_EQ(beside.value.shapes(), 6u);
    EXPECT_EQ(beside.value.shapes_pending(), 0u);
    expectSameHits(client, name_ + "-copy");

    TemporaryDirectory folder;
    const ServerProcess elsewhere(folder.path());
    Client other(elsewhere.address());
    ASSERT_TRUE(addAndWait(other, "default", "first", dumbbell(50)).ok());
    const auto moved = importCollection(other, "", saved.messages);
    ASSERT_TRUE(moved.ok()) << moved;
    EXPECT_EQ(moved.value.collection(), name_) << "the name in the file";
    expectSameHits(other, name_);

    // Work goes on in the copy, and the original does not notice.
    ASSERT_TRUE(addAndWait(other, name_, "new", dumbbell(60)).ok());
    EXPECT_EQ(listAll(other, name_).size(), 7u);
    EXPECT_EQ(listAll(client, name_).size(), 6u);
    const auto again = exportCollection(other, name_);
    ASSERT_TRUE(again.ok()) << again;
    ASSERT_TRUE(importCollection(client, name_ + "-back", again.messages).ok());
    EXPECT_EQ(hitsByKey(client, name_ + "-back", "k9", false), hitsByKey(other, name_, "k9", false));
}

TEST_F(TransferRpc, PendingShapesAreSegmentedAndFailedOnesStayFailed) {
    ASSERT_TRUE(addAndWait(client, collection, "open", openSheet()).ok());
    const Scan slow = slowScan(1, 10'000);
    for (int i = 0; i < 4; ++i) {
        ASSERT_TRUE(addShape(client, headerFor(collection, std::to_string(i), slow), slow).ok());
    }
    const auto saved = exportCollection(client, collection);
    ASSERT_TRUE(saved.ok()) << saved;
    const auto imported = importCollection(client, collection + "-copy", saved.messages);
    ASSERT_TRUE(imported.ok()) << imported;
    EXPECT_EQ(imported.value.shapes(), 5u);
    EXPECT_TRUE(eventually([&] {
        const auto all = listAll(client, collection + "-copy");
        return std::count_if(all.begin(), all.end(), [](const pb::Shape& shape) {
                   return shape.state() == pb::SHAPE_STATE_READY;
               }) == 4;
    }));
    EXPECT_EQ(getShape(client, collection + "-copy", "open").value.failure().error(), "no_interior");
    EXPECT_EQ(searchByScan(client, searchOptions(collection + "-copy"), dumbbell(9)).value.candidates(), 4u);
}

TEST_F(TransferRpc, RefusesBadImportsAndKeepsNothing) {
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell(1)).ok());
    const auto saved = exportCollection(client, collection);
    ASSERT_TRUE(saved.ok()) << saved;
    const auto refused = [&](const Reply<pb::ImportCollectionResponse>& reply, const std::string& error) {
        EXPECT_EQ(reply.error, error) << reply;
        EXPECT_EQ(reply.status.error_message().find(directory()->path()), std::string::npos)
            << "names no file of the server: " << reply;
        EXPECT_FALSE(exists("copy"));
    };
    EXPECT_EQ(exportCollection(client, "not there").error, "not_found");
    refused(send(client, {}), "malformed_stream");
    auto headless = messagesOf("copy", saved.messages);
    headless.erase(headless.begin());
    refused(send(client, headless), "malformed_stream");
    auto twice = messagesOf("copy", saved.messages);
    twice.insert(twice.begin(), twice.front());
    refused(send(client, twice), "malformed_stream");
    refused(send(client, {pb::ImportCollectionRequest()}), "malformed_stream");
    Chunks flipped = saved.messages;
    flipped.front().mutable_data()->at(5'000) ^= 1;
    refused(importCollection(client, "copy", flipped), "checksum_mismatch");
    Chunks cut = saved.messages;
    cut.front().mutable_data()->resize(1'000);
    refused(importCollection(client, "copy", cut), "count_mismatch");
    refused(importCollection(client, "copy", chunksOfText(std::string(5'000, 'x'))), "malformed_file");
    for (const char* name : {".import", "a/b", "../x"}) {
        refused(importCollection(client, name, saved.messages), "invalid_argument");
    }
    refused(importCollection(client, collection, saved.messages), "already_exists");
    refused(importCollection(client, "", saved.messages), "already_exists");
    CallContext context;
    const auto reader = client.admin->Backup(&context, pb::BackupRequest());
    const auto whole = testing::drain(context, *reader);
    refused(importCollection(client, "copy", whole.messages), "malformed_file");
    ASSERT_TRUE(importCollection(client, "copy", saved.messages).ok());
    EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(directory()->path() + "/data/tmp"); }));
}

// It would take the place of all collections.
TEST_F(TransferRpc, AnExportIsImportedAndNotRestored) {
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell(1)).ok());
    const auto saved = exportCollection(client, collection);
    ASSERT_TRUE(saved.ok()) << saved;
    TemporaryDirectory folder;
    const ServerProcess elsewhere(folder.path());
    Client other(elsewhere.address());
    CallContext context;
    pb::RestoreResponse restored;
    const auto writer = other.admin->Restore(&context, &restored);
    for (const pb::BackupChunk& chunk : saved.messages) {
        if (!writer->Write(chunk)) break;
    }
    writer->WritesDone();
    const grpc::Status refused = writer->Finish();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_NE(refused.error_message().find("shapedb collection import"), std::string::npos)
        << refused.error_message();
    const auto imported = importCollection(other, collection, saved.messages);
    ASSERT_TRUE(imported.ok()) << imported;
    EXPECT_EQ(imported.value.shapes(), 1u);
    EXPECT_EQ(searchByScan(other, searchOptions(collection), dumbbell(9)).value.candidates(), 1u);
    ASSERT_TRUE(addAndWait(other, "", "k", dumbbell(2)).ok()) << "the default collection is there";
}

}  // namespace
}  // namespace shapedb::testing
