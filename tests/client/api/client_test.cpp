// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/client.h"

#include <chrono>
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>

#include "client/api/packing.h"
#include "common/sha256.h"
#include "tests/client/api/fake_server.h"
#include "tests/support/eventually.h"

namespace shapedb::client {
namespace {

using std::chrono::milliseconds;

PointCloud cloud(std::size_t count) {
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i)
        points.push_back({1.0 * (i % 100), 1.0 * (i / 100 % 100), i / 1e4});
    return points;
}

double secondsOf(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Every call: the queue is full, come back in `pushback` milliseconds; negative: do not.
Answer queueFull(const std::string& pushback) {
    return [pushback](grpc::ServerContext& context, int) {
        context.AddTrailingMetadata("grpc-retry-pushback-ms", pushback);
        return namedError(context, grpc::StatusCode::RESOURCE_EXHAUSTED, "queue_full", "the queue is full");
    };
}

TEST(Client, OptionsAreValidated) {
    EXPECT_EQ(Client::connect({""}).error().code, ErrorCode::kInvalidArgument);
    ClientOptions options;
    options.deadline = milliseconds(-1);
    EXPECT_EQ(Client::connect(options).error().code, ErrorCode::kInvalidArgument);
    options = {};
    options.retry.maxAttempts = 0;
    EXPECT_EQ(Client::connect(options).error().code, ErrorCode::kInvalidArgument);
}

TEST(Client, AddsTheDefaultPortToItsAddress) {
    const auto addressOf = [](const std::string& given) { return Client::connect({given})->address(); };
    EXPECT_EQ(addressOf("localhost"), "localhost:7878");
    EXPECT_EQ(addressOf("10.0.0.1"), "10.0.0.1:7878");
    EXPECT_EQ(addressOf("::1"), "[::1]:7878");
    EXPECT_EQ(addressOf("[fe80::2]"), "[fe80::2]:7878");
    for (const char* complete : {"localhost:1", "10.0.0.1:80", "[::1]:9", "unix:/run/shapedb.sock",
                                 "unix:shapedb.sock", "dns:///host:5"}) {
        EXPECT_EQ(addressOf(complete), complete);
    }
}

TEST(Client, ErrorsCarryTheServersNameAndMessage) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext& context, int) {
        return namedError(context, grpc::StatusCode::FAILED_PRECONDITION, "not_ready", "shape 'a' is queued");
    };
    const auto shape = server.client().getShape({"", "a"});
    ASSERT_FALSE(shape);
    EXPECT_EQ(shape.error().code, ErrorCode::kNotReady);
    EXPECT_EQ(shape.error().message, "shape 'a' is queued");
    EXPECT_EQ(server.shapes.calls, 1) << "not worth a second try";
}

TEST(Client, RetriesUntilTheServerIsReachable) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext&, int call) {
        return call < 3 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "starting") : grpc::Status::OK;
    };
    const auto shape = server.client().getShape({"cups", "a"});
    ASSERT_TRUE(shape) << shape.error().message;
    EXPECT_EQ(shape->key, "a");
    EXPECT_EQ(shape->collection, "cups");
    EXPECT_EQ(server.shapes.calls, 3);
}

TEST(Client, GivesUpAfterTheLastAttempt) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext&, int) {
        return grpc::Status(grpc::StatusCode::UNAVAILABLE, "down");
    };
    const auto shape = server.client(4).getShape({"", "a"});
    ASSERT_FALSE(shape);
    EXPECT_EQ(shape.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(shape.error().message.find(server.address()), std::string::npos);
    EXPECT_EQ(server.shapes.calls, 4);
}

TEST(Client, CallsThatAreNotIdempotentAreNotRetried) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext&, int) {
        return grpc::Status(grpc::StatusCode::UNAVAILABLE, "down");
    };
    EXPECT_FALSE(server.client().deleteShape({"", "a"}));
    EXPECT_EQ(server.shapes.calls, 1);

    AddRequest conditional;
    conditional.shape.key = "a";
    conditional.expectedVersion = 3;
    EXPECT_FALSE(server.client().addShape(conditional, cloud(10)));
    EXPECT_EQ(server.shapes.calls, 2);
}

TEST(Client, WaitsAsLongAsTheServerAsks) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext& context, int call) {
        if (call > 1) return grpc::Status::OK;
        context.AddTrailingMetadata("grpc-retry-pushback-ms", "300");
        return namedError(context, grpc::StatusCode::RESOURCE_EXHAUSTED, "queue_full", "the queue is full");
    };
    Result<AddReply> reply;
    const double seconds = secondsOf([&] { reply = server.client().addShape({{"", "a"}}, cloud(100)); });
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(server.shapes.calls, 2);
    EXPECT_GE(seconds, 0.3);
    EXPECT_LT(seconds, 5.0);
}

TEST(Client, RetryCountRestartsForAnotherReason) {
    FakeServer server;
    // Three times full, three times unreachable, then fine: neither reason four times in a row.
    server.shapes.answer = [](grpc::ServerContext& context, int call) {
        if (call <= 3) return namedError(context, grpc::StatusCode::RESOURCE_EXHAUSTED, "queue_full", "full");
        return call <= 6 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "away") : grpc::Status::OK;
    };
    const auto reply = server.client(4).addShape({{"", "a"}}, cloud(10));
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(server.shapes.calls, 7);
}

TEST(Client, NegativePushbackEndsTheRetries) {
    FakeServer server;
    server.shapes.answer = queueFull("-1");
    const auto reply = server.client().addShape({{"", "a"}}, cloud(100));
    ASSERT_FALSE(reply);
    EXPECT_EQ(reply.error().code, ErrorCode::kQueueFull);
    EXPECT_EQ(server.shapes.calls, 1);
}

TEST(Client, DoesNotWaitBeyondTheDeadline) {
    FakeServer server;
    server.shapes.answer = queueFull("60000");
    RunContext context;
    context.deadline = RunContext::Clock::now() + std::chrono::seconds(5);
    Result<AddReply> reply;
    EXPECT_LT(secondsOf([&] { reply = server.client().addShape({{"", "a"}}, cloud(100), context); }), 3.0);
    ASSERT_FALSE(reply);
    EXPECT_EQ(reply.error().code, ErrorCode::kQueueFull) << "reports the queue, not the deadline";
}

TEST(Client, UploadsInChunksWithCountAndChecksum) {
    FakeServer server;
    const PointCloud points = cloud(200'000);  // 2.4 MB
    AddRequest request;
    request.shape = {"cups", "a"};
    request.mode = AddMode::kInsertOnly;
    request.metadata = Metadata{{"label", "cup"}};
    std::uint64_t reported = 0;
    RunContext context;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t total) {
        EXPECT_STREQ(stage, "upload");
        EXPECT_GT(done, reported);
        EXPECT_EQ(total, 12u * 200'000);
        reported = done;
    };
    const auto reply = server.client().addShape(request, points, context);
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(reported, 12u * 200'000);
    EXPECT_EQ(reply->outcome, AddOutcome::kCreated);
    EXPECT_EQ(server.shapes.points, packPoints(points)->bytes);
    EXPECT_LE(server.shapes.largestChunk, std::size_t{1} << 20);
    EXPECT_EQ(server.shapes.header.point_count(), 200'000u);
    const Sha256Digest digest = sha256(server.shapes.points.data(), server.shapes.points.size());
    EXPECT_EQ(server.shapes.header.sha256(), std::string(digest.begin(), digest.end()));
    EXPECT_EQ(server.shapes.header.collection(), "cups");
    EXPECT_EQ(server.shapes.header.mode(), v1::ADD_MODE_INSERT_ONLY);
    EXPECT_EQ(server.shapes.header.metadata().at("label"), "cup");
    EXPECT_FALSE(server.shapes.header.has_expected_version());
}

TEST(Client, ARetriedUploadIsComplete) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext&, int call) {
        return call < 3 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "busy") : grpc::Status::OK;
    };
    const PointCloud points = cloud(150'000);
    ASSERT_TRUE(server.client().addShape({{"", "a"}}, points));
    EXPECT_EQ(server.shapes.calls, 3);
    EXPECT_EQ(server.shapes.points, packPoints(points)->bytes);
}

TEST(Client, FarScansAreSentRelativeToAnOrigin) {
    FakeServer server;
    PointCloud points = cloud(1000);
    ASSERT_TRUE(server.client().addShape({{"", "a"}}, points));
    EXPECT_FALSE(server.shapes.header.has_origin());
    for (Point3& p : points) p = p + Point3{5e6, 0.0, 0.0};
    ASSERT_TRUE(server.client().addShape({{"", "a"}}, points));
    EXPECT_NEAR(server.shapes.header.origin().x(), 5e6 + 49.5, 1.0);
    EXPECT_EQ(server.shapes.header.metadata().size(), 0u);
}

// A client that gives no metadata is told apart from one that gives an empty set.
TEST(Client, UploadsWithoutMetadataLeaveThoseOfTheShape) {
    FakeServer server;
    const auto sent = [&](const std::optional<Metadata>& metadata) {
        AddRequest request;
        request.shape.key = "a";
        request.metadata = metadata;
        EXPECT_TRUE(server.client().addShape(request, cloud(1000)));
        return server.shapes.header;
    };
    const auto none = sent(std::nullopt);
    EXPECT_TRUE(none.metadata().empty());
    EXPECT_FALSE(none.has_metadata_change());
    const auto empty = sent(Metadata{});
    EXPECT_TRUE(empty.metadata_change().replace_all());
    EXPECT_TRUE(empty.metadata_change().set().empty());
    const auto some = sent(Metadata{{"label", "cup"}});
    EXPECT_EQ(some.metadata().at("label"), "cup");
    EXPECT_FALSE(some.has_metadata_change());
}

TEST(Client, BadScansAreNotSent) {
    FakeServer server;
    EXPECT_EQ(server.client().addShape({{"", "a"}}, {}).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(server.client().searchByScan({}, {{0, 0, 1e300}}).error().code,
              ErrorCode::kCoordinateOutOfRange);
    EXPECT_EQ(server.shapes.calls, 0);
}

TEST(Client, HonoursTheDeadlinesOfOptionsAndContext) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext& context, int) {
        for (int i = 0; i < 3'000 && !context.IsCancelled(); ++i)
            std::this_thread::sleep_for(milliseconds(10));
        return grpc::Status::OK;
    };
    ClientOptions options;
    options.address = server.address();
    options.deadline = milliseconds(200);
    const auto impatient = Client::connect(options);
    Result<Shape> shape;
    EXPECT_LT(secondsOf([&] { shape = impatient->getShape({"", "a"}); }), 10.0);
    ASSERT_FALSE(shape);
    EXPECT_EQ(shape.error().code, ErrorCode::kDeadlineExceeded);

    RunContext context;
    context.deadline = RunContext::Clock::now() + milliseconds(200);
    EXPECT_LT(secondsOf([&] { shape = server.client().getShape({"", "a"}, context); }), 10.0);
    ASSERT_FALSE(shape);
    EXPECT_EQ(shape.error().code, ErrorCode::kDeadlineExceeded);
}

TEST(Client, CancellingEndsARunningCall) {
    FakeServer server;
    server.shapes.answer = [](grpc::ServerContext& context, int) {
        for (int i = 0; i < 3'000 && !context.IsCancelled(); ++i)
            std::this_thread::sleep_for(milliseconds(10));
        return grpc::Status::OK;
    };
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    std::thread later([&] {
        EXPECT_TRUE(testing::eventually([&] { return server.shapes.calls > 0; }));
        cancel = true;
    });
    Result<Shape> shape;
    EXPECT_LT(secondsOf([&] { shape = server.client().getShape({"", "a"}, context); }), 10.0);
    later.join();
    ASSERT_FALSE(shape);
    EXPECT_EQ(shape.error().code, ErrorCode::kCancelled);

    const int calls = server.shapes.calls;
    EXPECT_EQ(server.client().getShape({"", "a"}, context).error().code, ErrorCode::kCancelled);
    EXPECT_EQ(server.shapes.calls, calls) << "cancelled before it began";
}

TEST(Client, CancellingEndsTheWaitBetweenAttempts) {
    FakeServer server;
    server.shapes.answer = queueFull("30000");
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    std::thread later([&] {
        EXPECT_TRUE(testing::eventually([&] { return server.shapes.calls > 0; }));
        cancel = true;
    });
    Result<AddReply> reply;
    EXPECT_LT(secondsOf([&] { reply = server.client().addShape({{"", "a"}}, cloud(10), context); }), 10.0);
    later.join();
    EXPECT_FALSE(reply);
}

TEST(Client, WatchReportsEveryEventAndReturnsTheLast) {
    FakeServer server;
    v1::IngestEvent pending;
    pending.set_state(v1::SHAPE_STATE_PENDING);
    pending.set_stage("delaunay");
    v1::IngestEvent failed;
    failed.set_state(v1::SHAPE_STATE_FAILED);
    failed.mutable_failure()->set_error("no_interior");
    failed.mutable_failure()->set_message("open below");
    server.shapes.events = {pending, failed};
    std::vector<std::string> stages;
    const auto last = server.client().watchIngest(
        {"", "a"}, [&](const IngestEvent& event) { stages.push_back(event.stage); });
    ASSERT_TRUE(last);
    EXPECT_EQ(stages, (std::vector<std::string>{"delaunay", ""}));
    EXPECT_EQ(last->state, ShapeState::kFailed);
    ASSERT_TRUE(last->failure);
    EXPECT_EQ(last->failure->code, ErrorCode::kNoInterior);
    EXPECT_EQ(last->failure->message, "open below");
}

TEST(Client, SegmentedPointsComeBackWithTheirLabels) {
    FakeServer server;
    v1::SegmentedPoints summary;
    summary.mutable_summary()->mutable_report()->set_points(2);
    summary.mutable_summary()->mutable_signature()->add_points()->set_weight(4.0);
    v1::SegmentedPoints chunk;
    chunk.mutable_chunk()->set_xyz(packPoints({{1, 2, 3}, {4, 5, 6}})->bytes);
    chunk.mutable_chunk()->add_segments(0);
    chunk.mutable_chunk()->add_segments(-1);
    server.shapes.segmented = {summary, chunk};
    const auto scan = server.client().segment(cloud(100'000), {}, false);
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(scan->segments, (std::vector<std::int32_t>{0, -1}));
    EXPECT_EQ(scan->report.points, 2u);
    EXPECT_EQ(scan->signature.points.at(0).weight, 4.0);

    chunk.mutable_chunk()->add_segments(7);
    server.shapes.segmented = {summary, chunk};
    EXPECT_EQ(server.client().segment(cloud(100), {}, false).error().code, ErrorCode::kMalformedStream);
}

TEST(Client, HealthFailsWithoutTheHealthService) {
    FakeServer server;
    const auto health = server.client().health();
    ASSERT_FALSE(health);
    EXPECT_EQ(health.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(health.error().message.find("not a ShapeDB server"), std::string::npos);
}

TEST(Client, UnreachableServerIsUnavailable) {
    ClientOptions options;
    options.address = "127.0.0.1:1";
    options.retry.maxAttempts = 2;
    const auto client = Client::connect(options);
    ASSERT_TRUE(client) << "connecting touches no network";
    const auto health = client->health();
    ASSERT_FALSE(health);
    EXPECT_EQ(health.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(health.error().message.find("127.0.0.1:1"), std::string::npos);
}

}  // namespace
}  // namespace shapedb::client
