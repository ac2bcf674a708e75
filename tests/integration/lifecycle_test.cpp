// SPDX-License-Identifier: GPL-3.0-or-later
// Drain, kill and restart; a full queue; a scan that crashes the server.
#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>
#include <signal.h>

#include "tests/integration/support/client.h"
#include "tests/integration/support/server_process.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;

class Lifecycle : public ::testing::Test {
  protected:
    void start(const std::vector<std::string>& arguments = {}) {
        client.reset();
        server.reset();
        server = std::make_unique<ServerProcess>(directory.path(), arguments);
        client = std::make_unique<Client>(server->address());
    }

    /// Adds without waiting; true when it was acknowledged.
    bool add(const std::string& key, const Scan& scan) {
        return addShape(*client, headerFor("", key, scan), scan).ok();
    }

    pb::ShapeState stateOf(const std::string& key) { return getShape(*client, "", key).value.state(); }

    /// True when a worker is inside the segmentation of this shape.
    bool beingSegmented(const std::string& key) {
        pb::WatchIngestRequest request;
        request.mutable_shape()->set_key(key);
        CallContext context;
        const auto reader = client->shapes->WatchIngest(&context, request);
        pb::IngestEvent event;
        const bool running =
            reader->Read(&event) && event.state() == pb::SHAPE_STATE_PENDING && event.stage() != "queued";
        context.get().TryCancel();
        (void)reader->Finish();
        return running;
    }

    TemporaryDirectory directory;
    std::unique_ptr<ServerProcess> server;
    std::unique_ptr<Client> client;
};

TEST_F(Lifecycle, RestartFindsEverythingAgain) {
    start();
    ASSERT_TRUE(createCollection(*client, "kept").ok());
    ASSERT_TRUE(addAndWait(*client, "kept", "k", dumbbell(), {{"label", "d"}}).ok());
    const auto before = searchByScan(*client, searchOptions("kept"), dumbbell(2));
    server->signal(SIGTERM);
    EXPECT_EQ(server->wait(), 0);
    start();
    const auto after = searchByScan(*client, searchOptions("kept"), dumbbell(2));
    ASSERT_TRUE(after.ok()) << after;
    ASSERT_EQ(after.value.hits_size(), 1);
    EXPECT_EQ(after.value.hits(0).score(), before.value.hits(0).score());
    EXPECT_EQ(after.value.hits(0).shape().metadata().at("label"), "d");
}

TEST_F(Lifecycle, TerminationRequeuesJobsForTheRestart) {
    start({"--ingest-threads", "1", "--shutdown-drain-seconds", "1"});
    // Made first: on a busy machine the first would be done before the last is made.
    std::vector<Scan> scans;
    for (std::uint64_t i = 0; i < 3; ++i) scans.push_back(slowScan(i));
    for (std::size_t i = 0; i < scans.size(); ++i) ASSERT_TRUE(add(std::to_string(i), scans[i]));
    ASSERT_TRUE(eventually([&] { return statsOf(*client).running_jobs() > 0; }));
    const auto began = std::chrono::steady_clock::now();
    server->signal(SIGTERM);
    EXPECT_EQ(server->wait(), 0) << server->log();
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(15));
    // Three drains: a job that is put back has not used up an attempt.
    for (int i = 0; i < 2; ++i) {
        start({"--ingest-threads", "1", "--shutdown-drain-seconds", "0"});
        ASSERT_TRUE(eventually(
            [&] { return statsOf(*client).running_jobs() > 0 || statsOf(*client).shapes_pending() == 0; }));
        server->signal(SIGTERM);
        EXPECT_EQ(server->wait(), 0) << server->log();
    }
    start();
    EXPECT_TRUE(eventually([&] { return statsOf(*client).shapes_ready() == 3; }));
}

TEST_F(Lifecycle, RunningCallsMayFinishWhileDraining) {
    start({"--shutdown-drain-seconds", "20"});
    const Scan slow = slowScan(3, 60'000);
    pb::AddShapeHeader header = headerFor("", "k", slow);
    header.set_wait(true);
    auto waiting = std::async(std::launch::async, [&] { return addShape(*client, header, slow); });
    ASSERT_TRUE(eventually([&] { return getShape(*client, "", "k").ok(); }));
    server->signal(SIGTERM);
    const auto reply = waiting.get();
    EXPECT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.shape().state(), pb::SHAPE_STATE_READY);
    EXPECT_EQ(server->wait(), 0);
}

TEST_F(Lifecycle, NewCallsAreRefusedWhileDraining) {
    start({"--shutdown-drain-seconds", "20"});
    CallContext context;
    pb::AddShapeResponse response;
    const auto upload = client->shapes->AddShape(&context, &response);  // keeps the drain waiting
    const Scan scan = slowScan(4, 60'000);
    const std::vector<std::string> chunks = chunksOf(scan, 30'000);
    pb::AddShapeRequest message;
    *message.mutable_header() = headerFor("", "k", scan);
    ASSERT_TRUE(upload->Write(message));
    // More than HTTP/2 lets a client send before the handler reads: once it is written, the call has begun.
    message.mutable_chunk()->set_xyz(chunks.front());
    ASSERT_TRUE(upload->Write(message));
    server->signal(SIGTERM);
    EXPECT_TRUE(eventually([&] { return getShape(*client, "", "k").error == "unavailable"; }));
    message.mutable_chunk()->set_xyz(chunks.back());
    EXPECT_TRUE(upload->Write(message));
    upload->WritesDone();
    EXPECT_TRUE(upload->Finish().ok()) << "a call that was running may finish";
    EXPECT_EQ(server->wait(), 0);
    start();
    EXPECT_TRUE(eventually([&] { return stateOf("k") == pb::SHAPE_STATE_READY; }));
}

TEST_F(Lifecycle, DrainEndsCallsThatOnlyFollow) {
    start({"--ingest-threads", "1", "--shutdown-drain-seconds", "20"});
    ASSERT_TRUE(add("k", slowScan(4, 190'000)));
    pb::WatchIngestRequest request;
    request.mutable_shape()->set_key("k");
    CallContext context;
    const auto reader = client->shapes->WatchIngest(&context, request);
    pb::IngestEvent event;
    ASSERT_TRUE(reader->Read(&event));
    server->signal(SIGTERM);
    const auto rest = testing::drain(context, *reader);
    EXPECT_EQ(rest.status.error_code(), StatusCode::UNAVAILABLE) << rest;
    EXPECT_EQ(server->wait(std::chrono::seconds(5)), 0);
}

TEST_F(Lifecycle, SecondSignalStopsAtOnce) {
    start({"--shutdown-drain-seconds", "60"});
    CallContext context;
    pb::AddShapeResponse response;
    const auto upload = client->shapes->AddShape(&context, &response);
    const Scan scan = slowScan(11, 80'000);
    pb::AddShapeRequest message;
    *message.mutable_header() = headerFor("", "k", scan);
    ASSERT_TRUE(upload->Write(message));
    // More than fits on the way: once it is written, the server has begun to read this call.
    const auto chunks = chunksOf(scan, 20'000);
    for (std::size_t i = 0; i + 1 < chunks.size(); ++i) {
        message.mutable_chunk()->set_xyz(chunks[i]);
        ASSERT_TRUE(upload->Write(message));
    }
    server->signal(SIGTERM);
    EXPECT_TRUE(eventually([&] { return getShape(*client, "", "k").error == "unavailable"; }));
    server->signal(SIGTERM);
    EXPECT_EQ(server->wait(std::chrono::seconds(5)), 130);
    context.get().TryCancel();
    (void)upload->Finish();
}

// The promise: acknowledged means durable.
TEST_F(Lifecycle, KillDuringIngestLosesNothingAcknowledged) {
    start({"--ingest-threads", "2"});
    std::vector<std::string> acknowledged;
    std::mutex mutex;
    std::vector<std::thread> uploads;
    std::atomic<bool> stop{false};
    for (int t = 0; t < 4; ++t) {
        uploads.emplace_back([&, t] {
            Client own(server->address());
            for (int i = 0; !stop; ++i) {
                const Scan scan = dumbbell(static_cast<std::uint64_t>(1'000 * t + i), 600);
                const std::string key = std::to_string(t) + "/" + std::to_string(i);
                const auto reply = addShape(own, headerFor("", key, scan), scan, std::chrono::seconds(5));
                if (!reply.ok()) return;
                const std::lock_guard<std::mutex> lock(mutex);
                acknowledged.push_back(key);
            }
        });
    }
    EXPECT_TRUE(eventually([&] {
        const std::lock_guard<std::mutex> lock(mutex);
        return acknowledged.size() >= 30;
    }));
    server->kill();
    stop = true;
    for (std::thread& upload : uploads) upload.join();

    start();
    for (const std::string& key : acknowledged) EXPECT_TRUE(getShape(*client, "", key).ok()) << key;
    EXPECT_TRUE(eventually([&] { return statsOf(*client).shapes_pending() == 0; }));
    for (const pb::Shape& shape : listAll(*client, "")) {
        EXPECT_EQ(shape.state(), pb::SHAPE_STATE_READY) << shape.ShortDebugString();
    }
    CallContext context;
    const auto reader = client->admin->Check(&context, pb::CheckRequest());
    const auto checked = testing::drain(context, *reader);
    ASSERT_TRUE(checked.ok()) << checked;
    EXPECT_TRUE(checked.messages.back().problems().empty()) << checked.messages.back().ShortDebugString();
}

// To the server this scan looks guilty: it died twice while segmenting it.
TEST_F(Lifecycle, KillsFromOutsideFailNoScan) {
    const std::vector<std::string> oneWorker = {"--ingest-threads", "1", "--limits-max-points", "1000000"};
    start(oneWorker);
    ASSERT_TRUE(add("large", slowScan(5, 250'000)));
    ASSERT_TRUE(add("small", dumbbell()));
    ASSERT_TRUE(eventually([&] { return beingSegmented("large"); }));
    server->kill();
    start(oneWorker);
    EXPECT_TRUE(eventually([&] { return stateOf("small") == pb::SHAPE_STATE_READY; }))
        << "the one that was not in hand comes first";
    for (int kill = 0; kill < 3; ++kill) {
        ASSERT_TRUE(eventually([&] { return beingSegmented("large"); })) << kill;
        server->kill();
        start(oneWorker);
    }
    EXPECT_TRUE(eventually([&] { return stateOf("large") == pb::SHAPE_STATE_READY; }));
}

TEST_F(Lifecycle, AFailedScanIsTriedAgainWhenItIsSentAgain) {
    start({});
    ASSERT_TRUE(createCollection(*client, "shells").ok());
    const Scan hollow = openSheet();
    const auto failed = addAndWait(*client, "shells", "k", hollow);
    ASSERT_EQ(failed.value.shape().state(), pb::SHAPE_STATE_FAILED) << failed;
    const auto again = addAndWait(*client, "shells", "k", hollow);
    EXPECT_EQ(again.value.outcome(), pb::AddShapeResponse::OUTCOME_RETRIED) << again;
    EXPECT_EQ(again.value.shape().state(), pb::SHAPE_STATE_FAILED);
}

TEST_F(Lifecycle, FullQueueRefusesWithAHint) {
    start({"--ingest-threads", "1", "--ingest-max-queued-jobs", "2"});
    // Jobs and bytes are counted the same way.
    ASSERT_TRUE(add("0", slowScan(6)));
    ASSERT_TRUE(add("1", slowScan(7)));
    const auto refused = addShape(*client, headerFor("", "2", dumbbell()), dumbbell());
    EXPECT_EQ(refused.status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << refused;
    EXPECT_EQ(refused.error, "queue_full");
    ASSERT_FALSE(refused.retryAfter.empty());
    EXPECT_GE(std::stoi(refused.retryAfter), 100);
    EXPECT_LE(std::stoi(refused.retryAfter), 60'000);
    EXPECT_EQ(getShape(*client, "", "2").error, "not_found") << "nothing is stored";
    EXPECT_TRUE(eventually([&] { return add("2", dumbbell()); })) << "there is room again later";
}

TEST_F(Lifecycle, FullQueueCountsBytes) {
    start({"--ingest-threads", "1", "--ingest-max-queued-bytes", "2MiB", "--limits-max-points", "170000"});
    ASSERT_TRUE(add("0", slowScan(8, 160'000)));
    const Scan scan = slowScan(9, 30'000);
    EXPECT_EQ(addShape(*client, headerFor("", "1", scan), scan).error, "queue_full");
    EXPECT_TRUE(add("2", dumbbell()));
}

TEST_F(Lifecycle, ConcurrentUploadsStayWithinTheirMemory) {
    start({"--limits-max-upload-bytes", "1MiB", "--limits-max-points", "80000"});
    const Scan scan = slowScan(10, 80'000);
    const auto chunks = chunksOf(scan, 60'000);
    pb::AddShapeResponse response;
    pb::AddShapeRequest message;
    std::unique_ptr<CallContext> context;
    std::unique_ptr<grpc::ClientWriter<pb::AddShapeRequest>> upload;
    Outcome refused;
    // The second may overtake the first; then the first is refused and starts again.
    ASSERT_TRUE(eventually([&] {
        context = std::make_unique<CallContext>();
        upload = client->shapes->AddShape(&context->get(), &response);
        *message.mutable_header() = headerFor("", "first", scan);
        EXPECT_TRUE(upload->Write(message));
        message.mutable_chunk()->set_xyz(chunks[0]);
        EXPECT_TRUE(upload->Write(message));
        refused = addShape(*client, headerFor("", "second", scan), scan);
        if (refused.error == "queue_full") return true;
        context->get().TryCancel();
        static_cast<void>(upload->Finish());
        return false;
    }));
    EXPECT_EQ(refused.status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << refused;
    EXPECT_FALSE(refused.retryAfter.empty());
    message.mutable_chunk()->set_xyz(chunks[1]);
    EXPECT_TRUE(upload->Write(message));
    upload->WritesDone();
    EXPECT_TRUE(upload->Finish().ok());
    EXPECT_TRUE(add("second", scan)) << "the memory is released";
}

TEST_F(Lifecycle, RestartContinuesARebuild) {
    start();
    for (int i = 0; i < 6; ++i) {
        ASSERT_TRUE(
            addAndWait(*client, "", std::to_string(i), slowScan(static_cast<std::uint64_t>(i), 6'000)).ok());
    }
    pb::RebuildRequest request;
    request.set_collection("default");
    request.mutable_signature()->set_max_points(3);
    {
        CallContext context;
        const auto reader = client->admin->Rebuild(&context, request);
        pb::RebuildProgress progress;
        while (reader->Read(&progress) && progress.done() == 0) {
        }
        ASSERT_GT(progress.done(), 0u);
        ASSERT_FALSE(progress.finished()) << "too quick to be interrupted";
        server->kill();
        (void)reader->Finish();
    }
    start();
    CallContext context;
    const auto reader = client->admin->Rebuild(&context, request);
    const auto followed = testing::drain(context, *reader);
    ASSERT_TRUE(followed.ok()) << followed;
    EXPECT_GT(followed.messages.front().done(), 0u) << "progress survives the kill";
    pb::GetCollectionRequest get;
    get.set_name("default");
    const auto now = unary(*client->collections, &pb::CollectionService::Stub::GetCollection, get);
    EXPECT_EQ(now.value.generation(), 2);
    EXPECT_EQ(now.value.signature().max_points(), 3u);
    EXPECT_EQ(now.value.shapes_ready(), 6u);
}

// A rebuild has no jobs, but a scan that crashes the server must not do so at every start.
TEST_F(Lifecycle, KillsDuringARebuildTakeNoShapeOutOfService) {
    const std::vector<std::string> arguments = {"--limits-max-points", "1000000"};
    start(arguments);
    const auto large = addAndWait(*client, "", "large", slowScan(5, 150'000));
    ASSERT_TRUE(large.ok()) << large;
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(addAndWait(*client, "", std::to_string(i), dumbbell(static_cast<std::uint64_t>(i))).ok());
    }
    pb::RebuildRequest request;
    request.set_collection("default");
    request.set_detach(true);
    for (int kill = 0; kill < 3; ++kill) {
        CallContext context;
        const auto reader = client->admin->Rebuild(&context, request);
        ASSERT_TRUE(testing::drain(context, *reader).ok());
        const std::string inHand =
            std::to_string(large.value.shape().id()) + " 1 0 " + std::to_string(kill) + " 1";
        ASSERT_TRUE(eventually([&] {
            return readFile(directory.path() + "/data/rebuild.journal").find(inHand) != std::string::npos;
        }));
        server->kill();
        start(arguments);
    }
    request.set_detach(false);
    CallContext context;
    const auto reader = client->admin->Rebuild(&context, request);
    const auto followed = testing::drain(context, *reader);
    ASSERT_TRUE(followed.ok()) << followed;
    EXPECT_EQ(server->log().find("scan set aside"), std::string::npos);
    EXPECT_EQ(stateOf("large"), pb::SHAPE_STATE_READY);
}

TEST_F(Lifecycle, StalledUploadIsCutOff) {
    start({"--limits-stall-seconds", "1"});
    CallContext context;
    pb::AddShapeResponse response;
    const auto upload = client->shapes->AddShape(&context, &response);
    pb::AddShapeRequest message;
    *message.mutable_header() = headerFor("", "k", dumbbell());
    ASSERT_TRUE(upload->Write(message));
    const auto began = std::chrono::steady_clock::now();
    const grpc::Status status = upload->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_EQ(status.error_message(),
              "cut off by the server: the client neither sent nor read anything for 1 seconds "
              "(limits.stall_seconds)");
    const auto took = std::chrono::steady_clock::now() - began;
    EXPECT_GT(took, std::chrono::milliseconds(700));
    EXPECT_LT(took, std::chrono::seconds(20));
    EXPECT_TRUE(eventually(
        [&] { return server->log().find("neither sent nor read anything") != std::string::npos; }));
    EXPECT_TRUE(add("k", dumbbell())) << "the server is unharmed";
}

}  // namespace
}  // namespace shapedb::testing
