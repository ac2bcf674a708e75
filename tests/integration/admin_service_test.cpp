// SPDX-License-Identifier: GPL-3.0-or-later
// AdminService on a live server: rebuild, backup, restore, check.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <future>
#include <set>
#include <thread>

#include "common/sha256.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;

/// A server for each test: restore replaces everything.
class AdminRpc : public ::testing::Test {
  protected:
    AdminRpc() : server(directory.path()), client(server.address()) {
        EXPECT_TRUE(createCollection(client, collection).ok());
    }

    void fill(int count, std::size_t points = 1'500) {
        for (int i = 0; i < count; ++i) {
            const Scan scan = dumbbell(static_cast<std::uint64_t>(i + 1), points);
            const auto added = addAndWait(client, collection, std::to_string(i), scan);
            ASSERT_TRUE(added.ok()) << added;
        }
    }

    Stream<pb::RebuildProgress> rebuild(const pb::RebuildRequest& request,
                                        std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
        CallContext context(timeout);
        const auto reader = client.admin->Rebuild(&context, request);
        return testing::drain(context, *reader);
    }

    pb::RebuildRequest rebuildRequest() const {
        pb::RebuildRequest request;
        request.set_collection(collection);
        return request;
    }

    pb::Collection collectionNow() {
        pb::GetCollectionRequest request;
        request.set_name(collection);
        const auto reply = unary(*client.collections, &pb::CollectionService::Stub::GetCollection, request);
        EXPECT_TRUE(reply.ok()) << reply;
        return reply.value;
    }

    std::string signatureOf(const std::string& key) {
        pb::GetSignatureRequest request;
        request.mutable_shape()->set_collection(collection);
        request.mutable_shape()->set_key(key);
        const auto reply = unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request);
        EXPECT_TRUE(reply.ok()) << reply;
        return reply.value.signature().encoded();
    }

    Stream<pb::BackupChunk> backup() {
        CallContext context;
        const auto reader = client.admin->Backup(&context, pb::BackupRequest());
        return testing::drain(context, *reader);
    }

    Reply<pb::RestoreResponse> restore(const std::vector<pb::BackupChunk>& chunks) {
        CallContext context;
        Reply<pb::RestoreResponse> reply;
        const auto writer = client.admin->Restore(&context, &reply.value);
        for (const pb::BackupChunk& chunk : chunks) {
            if (!writer->Write(chunk)) break;
        }
        writer->WritesDone();
        static_cast<Outcome&>(reply) = context.outcome(writer->Finish());
        return reply;
    }

    void expectRestoreRefused(const std::vector<pb::BackupChunk>& chunks, const std::string& error) {
        const auto reply = restore(chunks);
        EXPECT_EQ(reply.status.error_code(), StatusCode::INVALID_ARGUMENT) << reply;
        EXPECT_EQ(reply.error, error) << reply;
        EXPECT_EQ(reply.status.error_message().find(directory.path()), std::string::npos)
            << "names no file of the server: " << reply;
    }

    Stream<pb::CheckProgress> check() {
        CallContext context;
        const auto reader = client.admin->Check(&context, pb::CheckRequest());
        return testing::drain(context, *reader);
    }

    const std::string collection = "parts";
    TemporaryDirectory directory;
    ServerProcess server;
    Client client;
};

TEST_F(AdminRpc, RebuildRaisesTheGenerationAndKeepsResults) {
    fill(5);
    const std::string before = signatureOf("3");
    const auto progress = rebuild(rebuildRequest());
    ASSERT_TRUE(progress.ok()) << progress;
    const pb::RebuildProgress& last = progress.messages.back();
    EXPECT_TRUE(last.finished());
    EXPECT_EQ(last.collection(), collection);
    EXPECT_EQ(last.done(), 5u);
    EXPECT_EQ(last.total(), 5u);
    EXPECT_EQ(last.failed(), 0u);
    EXPECT_EQ(collectionNow().generation(), 2);
    EXPECT_EQ(signatureOf("3"), before) << "same parameters, same signature";
}

TEST_F(AdminRpc, RebuildWithNewParametersWhileSearching) {
    fill(8);
    std::atomic<bool> stop{false};
    auto searching = std::async(std::launch::async, [&] {
        Client own(server.address());
        int searches = 0;
        while (!stop) {
            const auto found = searchByScan(own, searchOptions(collection, 50), dumbbell(77, 1'000));
            EXPECT_TRUE(found.ok()) << found;
            // All or nothing: the old signatures with 7 points, or the new ones with 3.
            EXPECT_EQ(found.value.candidates(), 8u);
            EXPECT_EQ(found.value.hits_size(), 8);
            ++searches;
        }
        return searches;
    });
    pb::RebuildRequest request = rebuildRequest();
    request.mutable_signature()->set_max_points(3);
    const auto progress = rebuild(request);
    stop = true;
    EXPECT_GT(searching.get(), 0);
    ASSERT_TRUE(progress.ok()) << progress;
    const pb::Collection now = collectionNow();
    EXPECT_EQ(now.generation(), 2);
    EXPECT_EQ(now.signature().max_points(), 3u);
    EXPECT_EQ(now.segmentation().big_ball_ratio(), 0.5) << "what was not set keeps its value";
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.signature.maxPoints = 3;
    EXPECT_EQ(signatureOf("0"), encodeSignature(describe(unpack(dumbbell(1, 1'500)), parameters)->signature));
    // Shapes added from now on have them too.
    ASSERT_TRUE(addAndWait(client, collection, "later", dumbbell(50)).ok());
    EXPECT_EQ(signatureOf("later"), encodeSignature(describe(unpack(dumbbell(50)), parameters)->signature));
}

TEST_F(AdminRpc, ShapesAddedDuringARebuildGetTheNewParameters) {
    fill(6, 4'000);
    pb::RebuildRequest request = rebuildRequest();
    request.mutable_signature()->set_max_points(2);
    request.set_detach(true);
    const auto started = rebuild(request);
    ASSERT_TRUE(started.ok()) << started;
    ASSERT_EQ(started.messages.size(), 1u);
    const Scan later = dumbbell(100, 3'000);
    for (int i = 0; i < 5; ++i) {
        ASSERT_TRUE(addAndWait(client, collection, "new " + std::to_string(i), later).ok());
    }
    request.set_detach(false);
    ASSERT_TRUE(rebuild(request).ok()) << "the same request follows the rebuild, or repeats it if it is done";
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.signature.maxPoints = 2;
    const auto expected = [&](std::uint64_t seed, std::size_t points) {
        return encodeSignature(describe(unpack(dumbbell(seed, points)), parameters)->signature);
    };
    EXPECT_EQ(listAll(client, collection).size(), 11u);
    EXPECT_EQ(signatureOf("5"), expected(6, 4'000));
    const std::string added = expected(100, 3'000);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(signatureOf("new " + std::to_string(i)), added);
}

TEST_F(AdminRpc, SecondRebuildFollowsTheFirstOrIsRefused) {
    fill(4, 9'000);
    pb::RebuildRequest request = rebuildRequest();
    request.mutable_signature()->set_max_points(4);
    request.set_detach(true);
    ASSERT_TRUE(rebuild(request).ok());
    pb::RebuildRequest other = rebuildRequest();
    other.mutable_signature()->set_max_points(5);
    const auto refused = rebuild(other);
    EXPECT_EQ(refused.status.error_code(), StatusCode::FAILED_PRECONDITION) << refused;
    EXPECT_EQ(refused.error, "rejected");
    request.set_detach(false);
    const auto followed = rebuild(request);
    ASSERT_TRUE(followed.ok()) << followed;
    EXPECT_EQ(collectionNow().generation(), 2) << "followed, not started a second time";
}

TEST_F(AdminRpc, CancelledRebuildChangesNothing) {
    fill(4, 8'000);
    const std::string before = signatureOf("0");
    pb::RebuildRequest request = rebuildRequest();
    request.mutable_signature()->set_max_points(1);
    CallContext context;
    const auto reader = client.admin->Rebuild(&context, request);
    pb::RebuildProgress first;
    ASSERT_TRUE(reader->Read(&first));
    pb::CancelRebuildRequest cancel;
    cancel.set_collection(collection);
    ASSERT_TRUE(unary(*client.admin, &pb::AdminService::Stub::CancelRebuild, cancel).ok());
    const auto followed = testing::drain(context, *reader);
    EXPECT_EQ(followed.status.error_code(), StatusCode::CANCELLED) << followed;
    EXPECT_EQ(collectionNow().generation(), 1);
    EXPECT_EQ(collectionNow().signature().max_points(), 7u);
    EXPECT_EQ(signatureOf("0"), before);
    const auto again = unary(*client.admin, &pb::AdminService::Stub::CancelRebuild, cancel);
    EXPECT_EQ(again.status.error_code(), StatusCode::NOT_FOUND) << again;
    ASSERT_TRUE(rebuild(rebuildRequest()).ok()) << "another one can be started";
}

TEST_F(AdminRpc, RebuildContinuesWhenItsCallIsLost) {
    fill(4, 6'000);
    {
        CallContext context;
        const auto reader = client.admin->Rebuild(&context, rebuildRequest());
        pb::RebuildProgress first;
        ASSERT_TRUE(reader->Read(&first));
        context.get().TryCancel();
        EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
    }
    EXPECT_TRUE(eventually([&] { return collectionNow().generation() == 2; }));
}

TEST_F(AdminRpc, RebuildsAllCollectionsAndReloadsTheCache) {
    fill(3);
    ASSERT_TRUE(addAndWait(client, "", "in default", dumbbell()).ok());
    const auto all = rebuild(pb::RebuildRequest());
    ASSERT_TRUE(all.ok()) << all;
    std::set<std::string> finished;
    for (const auto& message : all.messages) {
        if (message.finished()) finished.insert(message.collection());
    }
    EXPECT_EQ(finished, (std::set<std::string>{"default", collection}));

    pb::RebuildRequest cacheOnly = rebuildRequest();
    cacheOnly.set_cache_only(true);
    const auto reloaded = rebuild(cacheOnly);
    ASSERT_TRUE(reloaded.ok()) << reloaded;
    EXPECT_EQ(reloaded.messages.back().done(), 3u);
    EXPECT_EQ(collectionNow().generation(), 2) << "nothing was segmented";
    EXPECT_EQ(searchByScan(client, searchOptions(collection), dumbbell(9)).value.candidates(), 3u);

    cacheOnly.mutable_signature()->set_max_points(3);
    EXPECT_EQ(rebuild(cacheOnly).error, "invalid_argument");
    pb::RebuildRequest nameless;
    nameless.set_profile(pb::PROFILE_PAPER);
    EXPECT_EQ(rebuild(nameless).error, "invalid_argument");
    pb::RebuildRequest outside = rebuildRequest();
    outside.mutable_signature()->set_max_points(0);
    EXPECT_EQ(rebuild(outside).error, "invalid_argument");
}

TEST_F(AdminRpc, RebuildRecordsScansThatCannotBeSegmented) {
    fill(2);
    ASSERT_TRUE(addAndWait(client, collection, "open", openSheet()).ok());
    const auto progress = rebuild(rebuildRequest());
    ASSERT_TRUE(progress.ok()) << progress;
    EXPECT_EQ(progress.messages.back().done(), 3u);
    EXPECT_EQ(progress.messages.back().failed(), 1u);
    EXPECT_EQ(getShape(client, collection, "open").value.failure().error(), "no_interior");
}

TEST_F(AdminRpc, BackupAndRestoreReproduceTheContent) {
    fill(3);
    const auto saved = backup();
    ASSERT_TRUE(saved.ok()) << saved;
    ASSERT_GE(saved.messages.size(), 2u);
    std::string all;
    for (const auto& chunk : saved.messages) all += chunk.data();
    EXPECT_EQ(saved.messages.front().total_bytes(), all.size());
    const auto digest = sha256(all.data(), all.size());
    EXPECT_EQ(saved.messages.back().sha256(), std::string(digest.begin(), digest.end()));
    EXPECT_EQ(all.rfind("SQLite format 3", 0), 0u);

    ASSERT_TRUE(addAndWait(client, collection, "later", dumbbell(60)).ok());
    pb::DeleteShapeRequest remove;
    remove.mutable_shape()->set_collection(collection);
    remove.mutable_shape()->set_key("1");
    ASSERT_TRUE(unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove).ok());
    ASSERT_TRUE(createCollection(client, "newer").ok());

    const auto restored = restore(saved.messages);
    ASSERT_TRUE(restored.ok()) << restored;
    EXPECT_EQ(restored.value.collections(), 2u);
    EXPECT_EQ(restored.value.shapes(), 3u);
    EXPECT_EQ(getShape(client, collection, "later").error, "not_found");
    EXPECT_TRUE(getShape(client, collection, "1").ok());
    EXPECT_EQ(listAll(client, collection).size(), 3u);
    pb::GetCollectionRequest gone;
    gone.set_name("newer");
    EXPECT_EQ(unary(*client.collections, &pb::CollectionService::Stub::GetCollection, gone).error,
              "not_found");
    // The index was replaced as well, and work continues.
    EXPECT_EQ(searchByScan(client, searchOptions(collection), dumbbell(9)).value.candidates(), 3u);
    ASSERT_TRUE(addAndWait(client, collection, "after", dumbbell(61)).ok());
    EXPECT_TRUE(check().messages.back().problems().empty());
}

TEST_F(AdminRpc, RestoreResumesUnfinishedJobs) {
    // A backup with jobs still queued: they are done after the restore.
    const Scan slow = slowScan(1, 30'000);
    for (int i = 0; i < 4; ++i) {
        ASSERT_TRUE(addShape(client, headerFor(collection, std::to_string(i), slow), slow).ok());
    }
    const auto saved = backup();
    ASSERT_TRUE(saved.ok()) << saved;
    pb::DeleteCollectionRequest remove;
    remove.set_name(collection);
    remove.set_force(true);
    ASSERT_TRUE(unary(*client.collections, &pb::CollectionService::Stub::DeleteCollection, remove).ok());
    ASSERT_TRUE(restore(saved.messages).ok());
    EXPECT_TRUE(eventually([&] {
        const auto all = listAll(client, collection);
        return all.size() == 4 && std::all_of(all.begin(), all.end(), [](const pb::Shape& shape) {
                   return shape.state() == pb::SHAPE_STATE_READY;
               });
    }));
}

// Ids that a call has looked up may mean other shapes after a restore.
TEST_F(AdminRpc, CallsDuringARestoreMustBeRepeated) {
    const Scan slow = slowScan(1, 100'000);
    ASSERT_TRUE(addShape(client, headerFor(collection, "k", slow), slow).ok());
    const auto saved = backup();
    ASSERT_TRUE(saved.ok()) << saved;
    pb::WatchIngestRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    CallContext context;
    const auto reader = client.shapes->WatchIngest(&context, request);
    pb::IngestEvent event;
    ASSERT_TRUE(reader->Read(&event));
    ASSERT_TRUE(restore(saved.messages).ok());
    const auto watched = testing::drain(context, *reader);
    EXPECT_EQ(watched.status.error_code(), StatusCode::UNAVAILABLE) << watched;
    EXPECT_EQ(watched.error, "unavailable");
    EXPECT_EQ(watched.retryAfter, "1000");
    EXPECT_TRUE(
        eventually([&] { return getShape(client, collection, "k").value.state() == pb::SHAPE_STATE_READY; }));
}

TEST_F(AdminRpc, RefusesBadBackupsAndChangesNothing) {
    fill(2);
    const auto saved = backup();
    ASSERT_TRUE(saved.ok()) << saved;
    const std::vector<pb::BackupChunk>& good = saved.messages;

    expectRestoreRefused({}, "malformed_stream");
    auto truncated = good;
    truncated.front().mutable_data()->resize(1'000);
    expectRestoreRefused(truncated, "count_mismatch");
    auto unsigned_ = good;
    unsigned_.pop_back();
    expectRestoreRefused(unsigned_, "malformed_stream");
    auto sizeless = good;
    sizeless.front().clear_total_bytes();
    expectRestoreRefused(sizeless, "malformed_stream");
    auto flipped = good;
    flipped.front().mutable_data()->at(5'000) ^= 1;
    expectRestoreRefused(flipped, "checksum_mismatch");
    auto longer = good;
    longer.insert(longer.end() - 1, good.front());
    longer[longer.size() - 2].clear_total_bytes();
    expectRestoreRefused(longer, "count_mismatch");
    auto afterTheEnd = good;
    afterTheEnd.push_back(good.back());
    expectRestoreRefused(afterTheEnd, "malformed_stream");

    const std::string text(5'000, 'x');
    const auto digest = sha256(text.data(), text.size());
    std::vector<pb::BackupChunk> other(2);
    other[0].set_total_bytes(text.size());
    other[0].set_data(text);
    other[1].set_sha256(digest.data(), digest.size());
    expectRestoreRefused(other, "malformed_file");

    EXPECT_EQ(listAll(client, collection).size(), 2u);
    EXPECT_EQ(searchByScan(client, searchOptions(collection), dumbbell(9)).value.candidates(), 2u);
    ASSERT_TRUE(addAndWait(client, collection, "after", dumbbell(61)).ok());
}

TEST_F(AdminRpc, CancelledBackupLeavesNoFile) {
    for (int i = 0; i < 3; ++i) {
        const Scan scan = slowScan(static_cast<std::uint64_t>(i), 100'000);
        ASSERT_TRUE(addShape(client, headerFor(collection, std::to_string(i), scan), scan).ok());
    }
    {
        CallContext context;
        const auto reader = client.admin->Backup(&context, pb::BackupRequest());
        pb::BackupChunk first;
        ASSERT_TRUE(reader->Read(&first));
        context.get().TryCancel();
        (void)reader->Finish();
    }
    const std::string folder = directory.path() + "/data/tmp";
    EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(folder); }));
}

TEST_F(AdminRpc, CheckFindsNoProblemInASoundDatabase) {
    fill(3);
    const auto checked = check();
    ASSERT_TRUE(checked.ok()) << checked;
    ASSERT_FALSE(checked.messages.empty());
    EXPECT_TRUE(checked.messages.back().finished());
    EXPECT_GT(checked.messages.back().total(), 0u);
    EXPECT_EQ(checked.messages.back().done(), checked.messages.back().total());
    for (const auto& message : checked.messages) EXPECT_TRUE(message.problems().empty());
}

}  // namespace
}  // namespace shapedb::testing
