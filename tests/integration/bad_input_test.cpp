// SPDX-License-Identifier: GPL-3.0-or-later
// Each kind of bad input gets its own error and code, stores nothing and leaves a working server.
#include <cmath>
#include <limits>

#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;

class BadInput : public LiveTest {
  protected:
    void TearDown() override {
        // No test stored anything, and a good scan is still accepted.
        pb::CountShapesRequest count;
        count.set_collection(collection);
        const auto counted = unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count);
        EXPECT_TRUE(counted.ok()) << counted;
        EXPECT_EQ(counted.value.count(), expectedShapes);
        const auto good = addAndWait(client, collection, "good", dumbbell());
        ASSERT_TRUE(good.ok()) << good;
        EXPECT_EQ(good.value.shape().state(), pb::SHAPE_STATE_READY);
    }

    static void expectRefused(const Outcome& outcome, StatusCode code, const std::string& error) {
        EXPECT_EQ(outcome.status.error_code(), code) << outcome;
        EXPECT_EQ(outcome.error, error) << outcome;
        EXPECT_FALSE(outcome.status.error_message().empty());
    }

    /// The scan is refused in all three places that take one, for the same reason.
    void expectScanRefused(const Scan& scan, const std::string& error, bool searchedToo = true) {
        expectRefused(addShape(client, headerFor(collection, "bad", scan), scan),
                      StatusCode::INVALID_ARGUMENT, error);
        if (!searchedToo) return;
        expectRefused(searchByScan(client, searchOptions(collection), scan), StatusCode::INVALID_ARGUMENT,
                      error);
        expectRefused(segmentScan(client, {}, scan), StatusCode::INVALID_ARGUMENT, error);
    }

    pb::AddShapeRequest header(std::uint64_t points) const {
        pb::AddShapeRequest request;
        request.mutable_header()->set_collection(collection);
        request.mutable_header()->set_key("bad");
        request.mutable_header()->set_point_count(points);
        return request;
    }

    static pb::AddShapeRequest chunk(const std::string& bytes) {
        pb::AddShapeRequest request;
        request.mutable_chunk()->set_xyz(bytes);
        return request;
    }

    std::uint64_t expectedShapes = 0;
};

TEST_F(BadInput, NanCoordinateIsRefusedWithItsIndex) {
    Scan scan = dumbbell();
    scan[3 * 1'234 + 1] = std::numeric_limits<float>::quiet_NaN();
    expectScanRefused(scan, "non_finite_coordinate");
    const auto reply = addShape(client, headerFor(collection, "bad", scan), scan);
    EXPECT_NE(reply.status.error_message().find("point 1234: y is NaN"), std::string::npos) << reply;
}

TEST_F(BadInput, InfiniteCoordinateIsRefused) {
    Scan scan = dumbbell();
    scan.back() = -std::numeric_limits<float>::infinity();
    expectScanRefused(scan, "non_finite_coordinate");
}

// 1e300 becomes infinite in single precision. The largest finite coordinate fits, but the extent of
// such a scan does not.
TEST_F(BadInput, HugeCoordinatesAreRefused) {
    Scan scan = dumbbell();
    scan[0] = static_cast<float>(1e300);
    expectScanRefused(scan, "non_finite_coordinate");
    scan[0] = std::numeric_limits<float>::max();
    expectScanRefused(scan, "coordinate_out_of_range");
}

TEST_F(BadInput, TinyCoordinatesAreRefused) {
    Scan scan = dumbbell();
    for (float& c : scan) c *= 1e-44f;  // a few denormal steps across
    expectScanRefused(scan, "coordinate_out_of_range");
    for (float& c : scan) c = static_cast<float>(1e-300);
    expectScanRefused(scan, "all_points_equal");
}

TEST_F(BadInput, FewerThanFourPointsAreRefused) {
    expectScanRefused({0, 0, 0, 1, 0, 0, 0, 1, 0}, "too_few_points");
    expectScanRefused({}, "too_few_points");
    // Four points, only three distinct.
    expectScanRefused({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0}, "too_few_points");
}

TEST_F(BadInput, EqualPointsAreRefused) { expectScanRefused(Scan(300, 2.5f), "all_points_equal"); }

TEST_F(BadInput, ManyCopiesOfOnePointAreRefused) {
    expectScanRefused(Scan(3 * 200'000, -1.0f), "all_points_equal");
}

TEST_F(BadInput, CollinearPointsAreRefused) {
    Scan scan;
    for (int i = 0; i < 100; ++i) {
        const float t = static_cast<float>(i);
        scan.insert(scan.end(), {t, 2.0f * t, -t});
    }
    expectScanRefused(scan, "collinear");
}

TEST_F(BadInput, CoplanarPointsAreRefused) {
    Scan scan;
    for (int i = 0; i < 400; ++i) {
        const float u = static_cast<float>(i % 20);
        const float v = static_cast<float>(i / 20);
        scan.insert(scan.end(), {u, v, u + v});
    }
    expectScanRefused(scan, "coplanar");
}

TEST_F(BadInput, ScanWithoutInteriorFailsAndCannotBeSearched) {
    const Scan scan = openSheet();
    expectRefused(searchByScan(client, searchOptions(collection), scan), StatusCode::INVALID_ARGUMENT,
                  "no_interior");
    pb::SegmentHeader header;
    header.set_profile(pb::PROFILE_PAPER);
    header.set_summary_only(true);
    expectRefused(segmentScan(client, header, scan), StatusCode::INVALID_ARGUMENT, "no_interior");
    // The recommended method always finds an interior, and reports its quality.
    header.set_profile(pb::PROFILE_DEFAULT);
    const auto adaptive = segmentScan(client, header, scan);
    ASSERT_TRUE(adaptive.ok()) << adaptive;
    EXPECT_LT(adaptive.messages[0].summary().report().quality(), 0.5);
    // Only the segmentation finds out: stored, then FAILED with the reason.
    const auto added = addAndWait(client, collection, "open", scan);
    ASSERT_TRUE(added.ok()) << added;
    EXPECT_EQ(added.value.shape().state(), pb::SHAPE_STATE_FAILED);
    EXPECT_EQ(added.value.shape().failure().error(), "no_interior");
    EXPECT_FALSE(added.value.shape().failure().message().empty());
    pb::GetSignatureRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("open");
    expectRefused(unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request),
                  StatusCode::FAILED_PRECONDITION, "not_ready");
    expectedShapes = 1;
}

TEST_F(BadInput, EmptyStreamIsRefused) {
    expectRefused(sendAddShape(client, {}), StatusCode::INVALID_ARGUMENT, "malformed_stream");
}

TEST_F(BadInput, MessageWithNeitherHeaderNorChunkIsRefused) {
    expectRefused(sendAddShape(client, {pb::AddShapeRequest()}), StatusCode::INVALID_ARGUMENT,
                  "malformed_stream");
}

TEST_F(BadInput, ChunkBeforeTheHeaderIsRefused) {
    const auto chunks = chunksOf(dumbbell());
    expectRefused(sendAddShape(client, {chunk(chunks[0]), header(2'000)}), StatusCode::INVALID_ARGUMENT,
                  "malformed_stream");
}

TEST_F(BadInput, SecondHeaderIsRefused) {
    const auto chunks = chunksOf(dumbbell());
    expectRefused(sendAddShape(client, {header(2'000), chunk(chunks[0]), header(2'000), chunk(chunks[1])}),
                  StatusCode::INVALID_ARGUMENT, "malformed_stream");
}

TEST_F(BadInput, ChunkAfterTheEndIsRefused) {
    const auto chunks = chunksOf(dumbbell());
    expectRefused(sendAddShape(client, {header(2'000), chunk(chunks[0]), chunk(chunks[1]), chunk(chunks[0])}),
                  StatusCode::INVALID_ARGUMENT, "malformed_stream");
}

TEST_F(BadInput, ChunkThatIsNotWholePointsIsRefused) {
    expectRefused(sendAddShape(client, {header(2'000), chunk(std::string(30, 'x'))}),
                  StatusCode::INVALID_ARGUMENT, "malformed_stream");
    expectRefused(sendAddShape(client, {header(2'000), chunk("")}), StatusCode::INVALID_ARGUMENT,
                  "malformed_stream");
}

TEST_F(BadInput, ChunkOverOneMebibyteIsRefused) {
    const std::string large(12 * 90'000, '\0');
    expectRefused(sendAddShape(client, {header(100'000), chunk(large)}), StatusCode::INVALID_ARGUMENT,
                  "malformed_stream");
}

TEST_F(BadInput, MessageOverTheTransportLimitIsRefused) {
    const std::string large(12 * 400'000, '\0');
    const auto reply = sendAddShape(client, {header(150'000), chunk(large)});
    EXPECT_EQ(reply.status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << reply;
}

TEST_F(BadInput, WrongChecksumIsRefused) {
    const Scan scan = dumbbell();
    pb::AddShapeHeader bad = headerFor(collection, "bad", scan);
    bad.set_sha256(sha256Of(dumbbell(2)));
    expectRefused(addShape(client, bad, scan), StatusCode::INVALID_ARGUMENT, "checksum_mismatch");
    bad.set_sha256("short");
    expectRefused(addShape(client, bad, scan), StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

TEST_F(BadInput, CountMismatchIsRefused) {
    const auto chunks = chunksOf(dumbbell());
    expectRefused(sendAddShape(client, {header(2'000), chunk(chunks[0])}), StatusCode::INVALID_ARGUMENT,
                  "count_mismatch");
    expectRefused(sendAddShape(client, {header(1'500), chunk(chunks[0]), chunk(chunks[1])}),
                  StatusCode::INVALID_ARGUMENT, "count_mismatch");
}

// A false header costs nothing: a billion points announced, ten sent.
TEST_F(BadInput, AnnouncedPointsOverTheLimitAreRefused) {
    const std::string ten = bytesOf(dumbbell()).substr(0, 120);
    expectRefused(sendAddShape(client, {header(1'000'000'000), chunk(ten)}), StatusCode::OUT_OF_RANGE,
                  "point_limit_exceeded");
    expectRefused(sendAddShape(client, {header(200'001), chunk(ten)}), StatusCode::OUT_OF_RANGE,
                  "point_limit_exceeded");
    expectRefused(sendAddShape(client, {header(200'000), chunk(ten)}), StatusCode::INVALID_ARGUMENT,
                  "count_mismatch");
}

TEST_F(BadInput, BadKeysAreRefused) {
    const Scan scan = dumbbell();
    for (const std::string& key : {std::string(), std::string(513, 'k'), std::string("a\nb")}) {
        const auto reply = addShape(client, headerFor(collection, key, scan), scan);
        expectRefused(reply, StatusCode::INVALID_ARGUMENT, "invalid_argument");
        EXPECT_NE(reply.status.error_message().find("key:"), std::string::npos) << reply;
    }
}

TEST_F(BadInput, BadMetadataIsRefused) {
    const Scan scan = dumbbell();
    pb::AddShapeHeader tooMany = headerFor(collection, "bad", scan);
    for (int i = 0; i < 65; ++i) (*tooMany.mutable_metadata())["k" + std::to_string(i)] = "v";
    pb::AddShapeHeader badKey = headerFor(collection, "bad", scan);
    (*badKey.mutable_metadata())["with space"] = "v";
    pb::AddShapeHeader longValue = headerFor(collection, "bad", scan);
    (*longValue.mutable_metadata())["k"] = std::string(1'025, 'v');
    for (const auto& bad : {tooMany, badKey, longValue}) {
        expectRefused(addShape(client, bad, scan), StatusCode::INVALID_ARGUMENT, "invalid_argument");
    }
}

TEST_F(BadInput, UnknownModeIsRefused) {
    pb::AddShapeHeader bad = headerFor(collection, "bad", dumbbell());
    bad.set_mode(static_cast<pb::AddMode>(77));
    expectRefused(addShape(client, bad, dumbbell()), StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

TEST_F(BadInput, UnknownCollectionIsNotFoundEverywhere) {
    const auto expectNotFound = [](const Outcome& outcome) {
        expectRefused(outcome, StatusCode::NOT_FOUND, "not_found");
        EXPECT_NE(outcome.status.error_message().find("nowhere"), std::string::npos) << outcome;
    };
    const Scan scan = dumbbell();
    expectNotFound(addShape(client, headerFor("nowhere", "bad", scan), scan));
    expectNotFound(searchByScan(client, searchOptions("nowhere"), scan));
    expectNotFound(getShape(client, "nowhere", "bad"));
    pb::ListShapesRequest list;
    list.set_collection("nowhere");
    expectNotFound(unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, list));
    pb::CountShapesRequest count;
    count.set_collection("nowhere");
    expectNotFound(unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count));
    pb::SearchByKeyRequest byKey;
    *byKey.mutable_options() = searchOptions("nowhere");
    byKey.set_key("bad");
    expectNotFound(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, byKey));
    pb::GetCollectionRequest get;
    get.set_name("nowhere");
    expectNotFound(unary(*client.collections, &pb::CollectionService::Stub::GetCollection, get));
    pb::DeleteCollectionRequest remove;
    remove.set_name("nowhere");
    expectNotFound(unary(*client.collections, &pb::CollectionService::Stub::DeleteCollection, remove));
    pb::RebuildRequest rebuild;
    rebuild.set_collection("nowhere");
    CallContext context;
    const auto reader = client.admin->Rebuild(&context, rebuild);
    expectNotFound(testing::drain(context, *reader));
    pb::CancelRebuildRequest cancel;
    cancel.set_collection("nowhere");
    expectNotFound(unary(*client.admin, &pb::AdminService::Stub::CancelRebuild, cancel));
}

TEST_F(BadInput, UnknownKeyIsNotFoundEverywhere) {
    const auto expectNotFound = [](const Outcome& outcome) {
        expectRefused(outcome, StatusCode::NOT_FOUND, "not_found");
        EXPECT_NE(outcome.status.error_message().find("nobody"), std::string::npos) << outcome;
    };
    pb::ShapeRef nobody;
    nobody.set_collection(collection);
    nobody.set_key("nobody");
    expectNotFound(getShape(client, collection, "nobody"));
    pb::GetSignatureRequest signature;
    *signature.mutable_shape() = nobody;
    expectNotFound(unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, signature));
    pb::DeleteShapeRequest remove;
    *remove.mutable_shape() = nobody;
    expectNotFound(unary(*client.shapes, &pb::ShapeService::Stub::DeleteShape, remove));
    pb::SearchByKeyRequest byKey;
    *byKey.mutable_options() = searchOptions(collection);
    byKey.set_key("nobody");
    expectNotFound(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, byKey));
    pb::CompareRequest compare;
    *compare.mutable_query() = nobody;
    *compare.mutable_other() = nobody;
    expectNotFound(unary(*client.searches, &pb::SearchService::Stub::Compare, compare));
    {
        pb::WatchIngestRequest watch;
        *watch.mutable_shape() = nobody;
        CallContext context;
        const auto reader = client.shapes->WatchIngest(&context, watch);
        expectNotFound(testing::drain(context, *reader));
    }
    {
        pb::GetSegmentsRequest segments;
        *segments.mutable_shape() = nobody;
        CallContext context;
        const auto reader = client.shapes->GetSegments(&context, segments);
        expectNotFound(testing::drain(context, *reader));
    }
    pb::AddShapeHeader update = headerFor(collection, "nobody", dumbbell());
    update.set_mode(pb::ADD_MODE_UPDATE_ONLY);
    expectNotFound(addShape(client, update, dumbbell()));
}

TEST_F(BadInput, KZeroOrOverTheLimitIsRefused) {
    for (const std::uint32_t k : {0u, 51u, 4'000'000'000u}) {
        const auto reply = searchByScan(client, searchOptions(collection, k), dumbbell());
        expectRefused(reply, StatusCode::INVALID_ARGUMENT, "invalid_argument");
        EXPECT_NE(reply.status.error_message().find("1 to 50"), std::string::npos) << reply;
    }
}

TEST_F(BadInput, ThresholdOutsideZeroToOneIsRefused) {
    for (const double threshold : {-0.1, 1.1, std::nan("")}) {
        pb::SearchOptions options = searchOptions(collection);
        options.set_threshold(threshold);
        expectRefused(searchByScan(client, options, dumbbell()), StatusCode::INVALID_ARGUMENT,
                      "invalid_argument");
    }
}

TEST_F(BadInput, MalformedFilterIsRefusedEverywhere) {
    pb::SearchOptions options = searchOptions(collection);
    options.set_filter("label=\"cup");
    expectRefused(searchByScan(client, options, dumbbell()), StatusCode::INVALID_ARGUMENT,
                  "malformed_filter");
    pb::ListShapesRequest list;
    list.set_collection(collection);
    list.set_filter("=cup");
    expectRefused(unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, list),
                  StatusCode::INVALID_ARGUMENT, "malformed_filter");
    pb::CountShapesRequest count;
    count.set_collection(collection);
    count.set_filter(std::string(20'000, 'a'));
    expectRefused(unary(*client.shapes, &pb::ShapeService::Stub::CountShapes, count),
                  StatusCode::INVALID_ARGUMENT, "malformed_filter");
}

TEST_F(BadInput, ForeignOrDamagedCursorIsRefused) {
    ASSERT_TRUE(addShape(client, headerFor(collection, "a", dumbbell()), dumbbell()).ok());
    ASSERT_TRUE(addShape(client, headerFor(collection, "b", dumbbell()), dumbbell()).ok());
    expectedShapes = 2;
    pb::ListShapesRequest request;
    request.set_collection(collection);
    request.set_page_size(1);
    const auto page = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, request);
    ASSERT_TRUE(page.ok()) << page;
    const std::string cursor = page.value.next_cursor();
    ASSERT_FALSE(cursor.empty());

    const auto expectMalformed = [&](const pb::ListShapesRequest& bad) {
        expectRefused(unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, bad),
                      StatusCode::INVALID_ARGUMENT, "malformed_cursor");
    };
    pb::ListShapesRequest otherFilter = request;
    otherFilter.set_cursor(cursor);
    otherFilter.set_filter("label");
    expectMalformed(otherFilter);
    pb::ListShapesRequest otherState = request;
    otherState.set_cursor(cursor);
    otherState.set_state(pb::SHAPE_STATE_READY);
    expectMalformed(otherState);
    pb::ListShapesRequest otherCollection = request;
    otherCollection.set_cursor(cursor);
    otherCollection.set_collection("default");
    expectMalformed(otherCollection);
    for (const std::string& damaged :
         {cursor.substr(1), cursor + "0", std::string("made up"), "1" + cursor.substr(1)}) {
        pb::ListShapesRequest bad = request;
        bad.set_cursor(damaged);
        expectMalformed(bad);
    }
    pb::ListShapesRequest tooLong = request;
    tooLong.set_page_size(1'001);
    expectRefused(unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, tooLong),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

TEST_F(BadInput, DamagedSignatureIsRefused) {
    pb::SearchBySignatureRequest request;
    *request.mutable_options() = searchOptions(collection);
    for (const std::string& bytes : {std::string(), std::string("not a signature"), std::string(400, '\0')}) {
        request.set_signature(bytes);
        expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchBySignature, request),
                      StatusCode::INVALID_ARGUMENT, "malformed_signature");
    }
}

TEST_F(BadInput, BatchErrorsNameTheQuery) {
    pb::SearchBatchRequest request;
    *request.mutable_options() = searchOptions(collection);
    expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchBatch, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    request.add_queries()->set_key("nobody");
    auto reply = unary(*client.searches, &pb::SearchService::Stub::SearchBatch, request);
    expectRefused(reply, StatusCode::NOT_FOUND, "not_found");
    EXPECT_EQ(reply.status.error_message().rfind("query 0:", 0), 0u) << reply;
    request.clear_queries();
    request.add_queries();
    expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchBatch, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    for (int i = 0; i < 9; ++i) request.add_queries()->set_key("x");
    reply = unary(*client.searches, &pb::SearchService::Stub::SearchBatch, request);
    expectRefused(reply, StatusCode::INVALID_ARGUMENT, "invalid_argument");
    EXPECT_NE(reply.status.error_message().find("1 to 8"), std::string::npos) << reply;
}

TEST_F(BadInput, ParametersOutsideTheirRangesAreRefused) {
    pb::CreateCollectionRequest request;
    request.set_name("refused");
    request.mutable_segmentation()->set_deep_angle_degrees(90.0);
    expectRefused(unary(*client.collections, &pb::CollectionService::Stub::CreateCollection, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    request.clear_segmentation();
    request.mutable_signature()->set_max_points(33);
    expectRefused(unary(*client.collections, &pb::CollectionService::Stub::CreateCollection, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    request.clear_signature();
    request.set_profile(static_cast<pb::Profile>(9));
    expectRefused(unary(*client.collections, &pb::CollectionService::Stub::CreateCollection, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    for (const std::string& name :
         {std::string(), std::string("-a"), std::string("a/b"), std::string(129, 'a')}) {
        pb::CreateCollectionRequest named;
        named.set_name(name);
        expectRefused(unary(*client.collections, &pb::CollectionService::Stub::CreateCollection, named),
                      StatusCode::INVALID_ARGUMENT, "invalid_argument");
    }
    pb::SegmentHeader header;
    header.mutable_segmentation()->set_merge_ratio(0.5);
    expectRefused(segmentScan(client, header, dumbbell()), StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

}  // namespace
}  // namespace shapedb::testing
