// SPDX-License-Identifier: GPL-3.0-or-later
// ShapeService on a live server.
#include <future>
#include <set>
#include <thread>

#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;
using ShapeRpc = LiveTest;

TEST_F(ShapeRpc, ReturnsAnAddedShapeInFull) {
    const Scan scan = dumbbell();
    pb::AddShapeHeader header = headerFor(collection, "ключ/1", scan);
    (*header.mutable_metadata())["label"] = "dumbbell";
    (*header.mutable_metadata())["year"] = "2004";
    header.set_sha256(sha256Of(scan));
    header.set_wait(true);
    const auto added = addShape(client, header, scan);
    ASSERT_TRUE(added.ok()) << added;
    EXPECT_EQ(added.value.outcome(), pb::AddShapeResponse::OUTCOME_CREATED);

    const auto got = getShape(client, collection, "ключ/1");
    ASSERT_TRUE(got.ok()) << got;
    EXPECT_EQ(got.value.SerializeAsString().size(), added.value.shape().SerializeAsString().size());
    EXPECT_EQ(got.value.collection(), collection);
    EXPECT_EQ(got.value.key(), "ключ/1");
    EXPECT_GT(got.value.id(), 0);
    EXPECT_EQ(got.value.version(), 1);
    EXPECT_EQ(got.value.state(), pb::SHAPE_STATE_READY);
    EXPECT_EQ(got.value.point_count(), 2'000u);
    EXPECT_EQ(got.value.sha256(), sha256Of(scan));
    EXPECT_EQ(got.value.metadata().at("label"), "dumbbell");
    EXPECT_EQ(got.value.metadata().at("year"), "2004");
    EXPECT_GT(got.value.created().seconds(), 1'500'000'000);
    EXPECT_FALSE(got.value.has_failure());
}

TEST_F(ShapeRpc, EmptyCollectionNameMeansDefault) {
    const auto added = addShape(client, headerFor("", "in default", dumbbell()), dumbbell());
    ASSERT_TRUE(added.ok()) << added;
    EXPECT_EQ(added.value.shape().collection(), "default");
    EXPECT_TRUE(getShape(client, "default", "in default").ok());
    EXPECT_TRUE(getShape(client, "", "in default").ok());
}

TEST_F(ShapeRpc, RetriesAndChangesReportTheirOutcome) {
    const Scan first = dumbbell(1);
    const Scan second = dumbbell(2);
    const auto add = [&](const Scan& scan, const std::string& label) {
        const auto reply = addAndWait(client, collection, "k", scan, {{"label", label}});
        EXPECT_TRUE(reply.ok()) << reply;
        return reply.value;
    };
    EXPECT_EQ(add(first, "a").outcome(), pb::AddShapeResponse::OUTCOME_CREATED);
    const auto repeated = add(first, "a");
    EXPECT_EQ(repeated.outcome(), pb::AddShapeResponse::OUTCOME_UNCHANGED);
    EXPECT_EQ(repeated.shape().version(), 1);
    const auto relabelled = add(first, "b");
    EXPECT_EQ(relabelled.outcome(), pb::AddShapeResponse::OUTCOME_METADATA_CHANGED);
    EXPECT_EQ(relabelled.shape().version(), 2);
    EXPECT_EQ(relabelled.shape().state(), pb::SHAPE_STATE_READY);
    const auto replaced = add(second, "b");
    EXPECT_EQ(replaced.outcome(), pb::AddShapeResponse::OUTCOME_REPLACED);
    EXPECT_EQ(replaced.shape().version(), 3);
    EXPECT_EQ(replaced.shape().id(), repeated.shape().id());
    EXPECT_EQ(listAll(client, collection).size(), 1u);
}

TEST_F(ShapeRpc, ModesAndExpectedVersionsAreObeyed) {
    const Scan scan = dumbbell(1);
    const Scan other = dumbbell(2);
    pb::AddShapeHeader insert = headerFor(collection, "k", scan);
    insert.set_mode(pb::ADD_MODE_INSERT_ONLY);
    EXPECT_TRUE(addShape(client, insert, scan).ok());
    EXPECT_TRUE(addShape(client, insert, scan).ok()) << "a repeated request is not an error";
    const auto taken = addShape(client, insert, other);
    EXPECT_EQ(taken.status.error_code(), StatusCode::ALREADY_EXISTS) << taken;
    EXPECT_EQ(taken.error, "already_exists");

    pb::AddShapeHeader update = headerFor(collection, "k", other);
    update.set_mode(pb::ADD_MODE_UPDATE_ONLY);
    update.set_expected_version(7);
    const auto conflict = addShape(client, update, other);
    EXPECT_EQ(conflict.status.error_code(), StatusCode::ABORTED) << conflict;
    EXPECT_EQ(conflict.error, "version_conflict");
    EXPECT_NE(conflict.status.error_message().find('7'), std::string::npos);
    update.set_expected_version(1);
    EXPECT_TRUE(addShape(client, update, other).ok());

    pb::AddShapeHeader mustBeFree = headerFor(collection, "k", scan);
    mustBeFree.set_expected_version(0);
    EXPECT_EQ(addShape(client, mustBeFree, scan).status.error_code(), StatusCode::ABORTED);
    pb::AddShapeHeader negative = headerFor(collection, "k", scan);
    negative.set_expected_version(-1);
    EXPECT_EQ(addShape(client, negative, scan).error, "invalid_argument");
    EXPECT_EQ(getShape(client, collection, "k").value.version(), 2);
}

TEST_F(ShapeRpc, ListingPagesByRisingIdAndFilters) {
    const Scan scan = dumbbell();
    std::set<std::string> keys;
    for (int i = 0; i < 7; ++i) {
        const std::string key = "shape " + std::to_string(i);
        keys.insert(key);
        pb::AddShapeHeader header = headerFor(collection, key, scan);
        (*header.mutable_metadata())["number"] = std::to_string(i);
        ASSERT_TRUE(addShape(client, header, scan).ok());
    }
    pb::ListShapesRequest request;
    request.set_collection(collection);
    request.set_page_size(3);
    std::set<std::string> seen;
    std::int64_t lastId = 0;
    int pages = 0;
    do {
        const auto page = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, request);
        ASSERT_TRUE(page.ok()) << page;
        for (const pb::Shape& shape : page.value.shapes()) {
            EXPECT_GT(shape.id(), lastId);
            lastId = shape.id();
            seen.insert(shape.key());
        }
        request.set_cursor(page.value.next_cursor());
        ++pages;
        if (pages == 1) {
            // Deleting listed shapes and adding others does not shift later pages.
            pb::DeleteShapeRequest remove;
            remove.mutable_shape()->set_collection(collection);
            remove.mutable_shape()->set_key("shape 0");
            ASSERT_TRUE(unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove).ok());
        }
    } while (!request.cursor().empty());
    EXPECT_EQ(seen, keys);
    EXPECT_EQ(pages, 3);

    pb::CountShapesRequest count;
    count.set_collection(collection);
    EXPECT_EQ(unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count).value.count(), 6u);
    count.set_filter("number>=5");
    EXPECT_EQ(unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count).value.count(), 2u);
    pb::ListShapesRequest filtered;
    filtered.set_collection(collection);
    filtered.set_filter("number=3");
    const auto one = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, filtered);
    ASSERT_EQ(one.value.shapes_size(), 1);
    EXPECT_EQ(one.value.shapes(0).key(), "shape 3");
    EXPECT_TRUE(one.value.next_cursor().empty());
}

// Shapes with as much metadata as allowed: a page ends before it exceeds what clients accept.
TEST_F(ShapeRpc, LongPagesEndEarlyAndContinue) {
    const Scan scan = dumbbell(1, 500);
    constexpr int kShapes = 60;
    for (int i = 0; i < kShapes; ++i) {
        pb::AddShapeHeader header = headerFor(collection, std::to_string(i), scan);
        for (int m = 0; m < 64; ++m)
            (*header.mutable_metadata())["k" + std::to_string(m)] = std::string(1'024, 'v');
        ASSERT_TRUE(addShape(client, header, scan).ok());
    }
    pb::ListShapesRequest request;
    request.set_collection(collection);
    request.set_page_size(1'000);
    int seen = 0;
    int pages = 0;
    do {
        const auto page = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, request);
        ASSERT_TRUE(page.ok()) << page;
        EXPECT_LT(page.value.ByteSizeLong(), 4u << 20);
        EXPECT_GT(page.value.shapes_size(), 0);
        seen += page.value.shapes_size();
        ++pages;
        request.set_cursor(page.value.next_cursor());
    } while (!request.cursor().empty());
    EXPECT_EQ(seen, kShapes);
    EXPECT_GE(pages, 2);
}

TEST_F(ShapeRpc, StateFilterFindsFailedShapes) {
    ASSERT_TRUE(addAndWait(client, collection, "good", dumbbell()).ok());
    ASSERT_TRUE(addAndWait(client, collection, "open", openSheet()).ok());
    pb::CountShapesRequest count;
    count.set_collection(collection);
    count.set_state(pb::SHAPE_STATE_FAILED);
    EXPECT_EQ(unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count).value.count(), 1u);
    pb::ListShapesRequest request;
    request.set_collection(collection);
    request.set_state(pb::SHAPE_STATE_READY);
    const auto ready = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, request);
    ASSERT_EQ(ready.value.shapes_size(), 1);
    EXPECT_EQ(ready.value.shapes(0).key(), "good");
}

TEST_F(ShapeRpc, DeletedShapeIsFoundNowhere) {
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell()).ok());
    pb::DeleteShapeRequest remove;
    remove.mutable_shape()->set_collection(collection);
    remove.mutable_shape()->set_key("k");
    remove.set_expected_version(9);
    EXPECT_EQ(unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove).error, "version_conflict");
    remove.set_expected_version(1);
    const auto deleted = unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove);
    ASSERT_TRUE(deleted.ok()) << deleted;
    EXPECT_EQ(deleted.value.shape().key(), "k");
    EXPECT_EQ(getShape(client, collection, "k").error, "not_found");
    const auto search = searchByScan(client, searchOptions(collection), dumbbell(2));
    ASSERT_TRUE(search.ok()) << search;
    EXPECT_EQ(search.value.hits_size(), 0);
    EXPECT_EQ(search.value.candidates(), 0u);
}

TEST_F(ShapeRpc, SignatureEqualsTheLibrarys) {
    const Scan scan = dumbbell(3, 4'000);
    ASSERT_TRUE(addAndWait(client, collection, "k", scan).ok());
    pb::GetSignatureRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    const auto reply = unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request);
    ASSERT_TRUE(reply.ok()) << reply;
    const auto expected = describe(unpack(scan), parametersOf(Profile::kPaper));
    ASSERT_TRUE(expected);
    EXPECT_EQ(reply.value.signature().encoded(), encodeSignature(expected->signature));
    ASSERT_EQ(static_cast<std::size_t>(reply.value.signature().points_size()),
              expected->signature.points.size());
    for (int i = 0; i < reply.value.signature().points_size(); ++i) {
        const pb::WeightedPoint& point = reply.value.signature().points(i);
        const auto index = static_cast<std::size_t>(i);
        const Point3 position = pointPosition(expected->signature, index);
        EXPECT_EQ(point.position().x(), position.x);
        EXPECT_EQ(point.position().y(), position.y);
        EXPECT_EQ(point.position().z(), position.z);
        EXPECT_EQ(point.weight(), pointVolume(expected->signature, index));
        EXPECT_EQ(point.extents_size(), 3);
        EXPECT_GE(point.extents(0), point.extents(1));
        EXPECT_GE(point.extents(1), point.extents(2));
    }
    EXPECT_EQ(reply.value.signature().scale(), expected->signature.scale);
    EXPECT_EQ(reply.value.signature().volume(), expected->signature.volume);
}

/// Points and labels of a segmentation stream, put together again.
struct Labelled {
    std::string xyz;
    std::vector<int> segments;
};

Labelled join(const std::vector<pb::SegmentedPoints>& messages) {
    Labelled labelled;
    for (std::size_t i = 1; i < messages.size(); ++i) {
        const pb::LabelledChunk& chunk = messages[i].chunk();
        EXPECT_EQ(chunk.xyz().size(), 12u * static_cast<std::size_t>(chunk.segments_size()));
        labelled.xyz += chunk.xyz();
        labelled.segments.insert(labelled.segments.end(), chunk.segments().begin(), chunk.segments().end());
    }
    return labelled;
}

TEST_F(ShapeRpc, SegmentAndGetSegmentsAgreeWithTheLibrary) {
    const Scan scan = dumbbell(4, 40'000);  // more than one chunk of answer
    const auto expected = describe(unpack(scan), parametersOf(Profile::kPaper));
    ASSERT_TRUE(expected);

    pb::SegmentHeader header;
    header.set_profile(pb::PROFILE_PAPER);
    const auto stateless = segmentScan(client, header, scan);
    ASSERT_TRUE(stateless.ok()) << stateless;
    ASSERT_GE(stateless.messages.size(), 3u);
    const pb::SegmentationSummary& summary = stateless.messages[0].summary();
    EXPECT_EQ(summary.report().points(), 40'000u);
    EXPECT_EQ(summary.report().segments(), expected->segmentation.segments.size());
    EXPECT_EQ(summary.report().tetrahedra(), expected->segmentation.tetrahedra.size());
    EXPECT_EQ(summary.report().volume(), expected->segmentation.volume);
    EXPECT_GT(summary.report().stages_size(), 3);
    EXPECT_EQ(summary.signature().encoded(), encodeSignature(expected->signature));
    const Labelled labelled = join(stateless.messages);
    EXPECT_EQ(labelled.xyz, bytesOf(scan));
    EXPECT_EQ(labelled.segments, std::vector<int>(expected->segmentation.pointSegment.begin(),
                                                  expected->segmentation.pointSegment.end()));

    header.set_summary_only(true);
    EXPECT_EQ(segmentScan(client, header, scan).messages.size(), 1u);
    header.set_report_stages(true);
    const auto told = segmentScan(client, header, scan);
    ASSERT_TRUE(told.ok()) << told;
    std::vector<std::string> names;
    for (const pb::SegmentedPoints& message : told.messages) {
        const std::string& stage = message.stage().stage();
        if (message.has_stage() && (names.empty() || names.back() != stage)) names.push_back(stage);
    }
    std::vector<std::string> expectedNames{"queued"};
    for (const pb::StageTime& stage : summary.report().stages()) expectedNames.push_back(stage.stage());
    EXPECT_EQ(names, expectedNames);
    EXPECT_TRUE(told.messages.back().has_summary());
    EXPECT_TRUE(listAll(client, collection).empty()) << "Segment stores nothing";

    ASSERT_TRUE(addAndWait(client, collection, "k", scan).ok());
    pb::GetSegmentsRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    CallContext context;
    const auto reader = client.shapes->GetSegments(&context, request);
    const auto stored = testing::drain(context, *reader);
    ASSERT_TRUE(stored.ok()) << stored;
    EXPECT_EQ(join(stored.messages).segments, labelled.segments);
    EXPECT_EQ(join(stored.messages).xyz, labelled.xyz);
}

TEST_F(ShapeRpc, WatchReportsStagesAndEnds) {
    const Scan scan = slowScan(5, 60'000);
    ASSERT_TRUE(addShape(client, headerFor(collection, "k", scan), scan).ok());
    pb::WatchIngestRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    CallContext context;
    const auto reader = client.shapes->WatchIngest(&context, request);
    const auto watched = testing::drain(context, *reader);
    ASSERT_TRUE(watched.ok()) << watched;
    ASSERT_GE(watched.messages.size(), 2u);
    EXPECT_EQ(watched.messages.front().state(), pb::SHAPE_STATE_PENDING);
    EXPECT_EQ(watched.messages.back().state(), pb::SHAPE_STATE_READY);
    std::set<std::string> stages;
    for (const auto& event : watched.messages) stages.insert(event.stage());
    EXPECT_EQ(stages.count("delaunay"), 1u);
    // Again: it is settled, so exactly one message.
    CallContext second;
    const auto again = client.shapes->WatchIngest(&second, request);
    EXPECT_EQ(testing::drain(second, *again).messages.size(), 1u);
}

TEST_F(ShapeRpc, WatchEndsWhenTheShapeIsDeleted) {
    const Scan scan = slowScan(6);
    ASSERT_TRUE(addShape(client, headerFor(collection, "k", scan), scan).ok());
    pb::WatchIngestRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    CallContext context;
    const auto reader = client.shapes->WatchIngest(&context, request);
    pb::IngestEvent first;
    ASSERT_TRUE(reader->Read(&first));
    pb::DeleteShapeRequest remove;
    *remove.mutable_shape() = request.shape();
    ASSERT_TRUE(unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove).ok());
    const auto rest = testing::drain(context, *reader);
    EXPECT_EQ(rest.error, "not_found") << rest;
    // The worker stops: the queue is empty long before the scan could have been finished.
    EXPECT_TRUE(eventually([&] { return statsOf(client).running_jobs() == 0; }));
}

TEST_F(ShapeRpc, ReplacingABusyShapeKeepsTheNewPoints) {
    const Scan slow = slowScan(7);
    ASSERT_TRUE(addShape(client, headerFor(collection, "k", slow), slow).ok());
    ASSERT_TRUE(eventually([&] { return statsOf(client).running_jobs() > 0; }));
    const Scan quick = dumbbell();
    const auto replaced = addAndWait(client, collection, "k", quick);
    ASSERT_TRUE(replaced.ok()) << replaced;
    EXPECT_EQ(replaced.value.outcome(), pb::AddShapeResponse::OUTCOME_REPLACED);
    EXPECT_EQ(replaced.value.shape().state(), pb::SHAPE_STATE_READY);
    EXPECT_EQ(replaced.value.shape().point_count(), 2'000u);
    pb::GetSignatureRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    const auto expected = describe(unpack(quick), parametersOf(Profile::kPaper));
    EXPECT_EQ(
        unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request).value.signature().encoded(),
        encodeSignature(expected->signature));
}

TEST_F(ShapeRpc, WaitPastTheDeadlineLeavesTheShapeStored) {
    const Scan scan = slowScan(8);
    pb::AddShapeHeader header = headerFor(collection, "k", scan);
    header.set_wait(true);
    const auto reply = addShape(client, header, scan, std::chrono::milliseconds(400));
    EXPECT_EQ(reply.status.error_code(), StatusCode::DEADLINE_EXCEEDED) << reply;
    EXPECT_TRUE(getShape(client, collection, "k").ok());
}

TEST_F(ShapeRpc, DeadlineStopsALongSegmentation) {
    const Scan scan = slowScan(9);
    pb::SegmentHeader header;
    header.set_summary_only(true);
    header.set_profile(pb::PROFILE_PAPER);
    const auto began = std::chrono::steady_clock::now();
    const auto reply = segmentScan(client, header, scan, std::chrono::milliseconds(300));
    EXPECT_EQ(reply.status.error_code(), StatusCode::DEADLINE_EXCEEDED) << reply;
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(15));
    // The server noticed too: it logs the end of the call and is free again.
    EXPECT_TRUE(eventually([&] {
        const std::string log = server()->log();
        return log.find("rpc=Segment") != std::string::npos &&
               log.find("code=DEADLINE_EXCEEDED") != std::string::npos;
    }));
}

TEST_F(ShapeRpc, CancelledUploadStoresNothing) {
    const Scan scan = dumbbell();
    const auto chunks = chunksOf(scan);
    CallContext context;
    pb::AddShapeResponse response;
    const auto writer = client.shapes->AddShape(&context, &response);
    pb::AddShapeRequest message;
    *message.mutable_header() = headerFor(collection, "k", scan);
    ASSERT_TRUE(writer->Write(message));
    message.mutable_chunk()->set_xyz(chunks[0]);
    ASSERT_TRUE(writer->Write(message));
    context.get().TryCancel();
    EXPECT_EQ(writer->Finish().error_code(), StatusCode::CANCELLED);
    EXPECT_TRUE(eventually([&] { return server()->log().find("code=CANCELLED") != std::string::npos; }));
    EXPECT_TRUE(listAll(client, collection).empty());
}

TEST_F(ShapeRpc, ManyClientsAtOnceLoseNothing) {
    constexpr int kClients = 8;
    constexpr int kEach = 5;
    std::vector<std::future<int>> added;
    for (int c = 0; c < kClients; ++c) {
        added.push_back(std::async(std::launch::async, [&, c] {
            Client own(server()->address());
            int good = 0;
            for (int i = 0; i < kEach; ++i) {
                const Scan scan = dumbbell(static_cast<std::uint64_t>(100 * c + i), 600);
                const std::string key = std::to_string(c) + "/" + std::to_string(i);
                good += addAndWait(own, collection, key, scan).ok() ? 1 : 0;
            }
            return good;
        }));
    }
    int good = 0;
    for (auto& result : added) good += result.get();
    EXPECT_EQ(good, kClients * kEach);
    const auto all = listAll(client, collection);
    EXPECT_EQ(all.size(), static_cast<std::size_t>(kClients * kEach));
    for (const pb::Shape& shape : all)
        EXPECT_EQ(shape.state(), pb::SHAPE_STATE_READY) << shape.ShortDebugString();
    // Each is searched at once: `wait` returns when the index has it.
    pb::SearchByKeyRequest request;
    *request.mutable_options() = searchOptions(collection, 50);
    request.set_key("0/0");
    request.set_include_self(true);
    EXPECT_EQ(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request).value.candidates(),
              static_cast<std::uint64_t>(kClients * kEach));
}

}  // namespace
}  // namespace shapedb::testing
