// SPDX-License-Identifier: GPL-3.0-or-later
// CollectionService on a live server.
#include "core/pipeline.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;
using CollectionRpc = LiveTest;
using Stub = pb::CollectionService::Stub;

TEST_F(CollectionRpc, DefaultCollectionExistsFromTheStart) {
    pb::GetCollectionRequest request;
    request.set_name("default");
    const auto reply = unary(*client.collections, &Stub::GetCollection, request);
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.profile(), pb::PROFILE_DEFAULT);
    EXPECT_EQ(reply.value.generation(), 1);
}

TEST_F(CollectionRpc, ReturnsAllParameters) {
    pb::CreateCollectionRequest request;
    request.set_name("with-parameters_1.0");
    request.set_description("Pièces");
    request.set_profile(pb::PROFILE_PAPER);
    request.mutable_segmentation()->set_big_ball_ratio(0.75);
    request.mutable_signature()->set_max_points(9);
    const auto created = unary(*client.collections, &Stub::CreateCollection, request);
    ASSERT_TRUE(created.ok()) << created;
    pb::GetCollectionRequest get;
    get.set_name(request.name());
    const auto got = unary(*client.collections, &Stub::GetCollection, get);
    ASSERT_TRUE(got.ok()) << got;
    EXPECT_EQ(got.value.description(), "Pièces");
    EXPECT_EQ(got.value.profile(), pb::PROFILE_PAPER);
    EXPECT_EQ(got.value.segmentation().big_ball_ratio(), 0.75);
    EXPECT_EQ(got.value.segmentation().deep_angle_degrees(), 20.0);
    EXPECT_EQ(got.value.segmentation().hull_angle_degrees(), 5.0);
    EXPECT_EQ(got.value.segmentation().merge_ratio(), 1.5);
    EXPECT_TRUE(got.value.segmentation().has_decimate_to());
    EXPECT_EQ(got.value.segmentation().decimate_to(), 0u);
    EXPECT_TRUE(got.value.segmentation().has_merge_contrast());
    EXPECT_EQ(got.value.segmentation().merge_contrast(), 0.0);
    EXPECT_EQ(got.value.segmentation().interior_method(), pb::INTERIOR_METHOD_WALK);
    EXPECT_EQ(got.value.signature().max_points(), 9u);
    EXPECT_GT(got.value.created().seconds(), 1'500'000'000);
}

// The profile supplies unset parameters; 0 is a value.
TEST_F(CollectionRpc, UnsetParametersAreTheProfiles) {
    const SegmentationOptions profile = parametersOf(Profile::kDefault).segmentation;
    pb::CreateCollectionRequest request;
    request.set_name(collection + "-partly");
    request.mutable_segmentation()->set_outlier_ratio(0.0);
    request.mutable_segmentation()->set_merge_contrast(1.75);
    const auto created = unary(*client.collections, &Stub::CreateCollection, request);
    ASSERT_TRUE(created.ok()) << created;
    const pb::SegmentationParameters& got = created.value.segmentation();
    EXPECT_EQ(got.outlier_ratio(), 0.0);
    EXPECT_EQ(got.merge_contrast(), 1.75);
    EXPECT_EQ(got.decimate_to(), profile.preparation.decimateTo);
    EXPECT_EQ(got.deep_angle_degrees(), profile.deepAngleDegrees);
    EXPECT_EQ(got.min_segment_share(), profile.minSegmentShare);
    EXPECT_EQ(got.max_segments(), profile.maxSegments);
    EXPECT_EQ(got.smoothing_reach(), profile.preparation.smoothingReach);
    EXPECT_EQ(got.thinning(), profile.preparation.thinning);
    EXPECT_EQ(got.interior_method() == pb::INTERIOR_METHOD_ADAPTIVE,
              profile.interiorMethod == InteriorMethod::kAdaptive);
}

TEST_F(CollectionRpc, TakenNameIsRefused) {
    const auto again = createCollection(client, collection);
    EXPECT_EQ(again.status.error_code(), StatusCode::ALREADY_EXISTS) << again;
    EXPECT_EQ(again.error, "already_exists");
}

TEST_F(CollectionRpc, ListsByNameWithCounts) {
    ASSERT_TRUE(addAndWait(client, collection, "good", dumbbell()).ok());
    ASSERT_TRUE(addAndWait(client, collection, "open", openSheet()).ok());
    const auto list = unary(*client.collections, &Stub::ListCollections, pb::ListCollectionsRequest());
    ASSERT_TRUE(list.ok()) << list;
    std::string last;
    bool seen = false;
    for (const pb::Collection& one : list.value.collections()) {
        EXPECT_LT(last, one.name());
        last = one.name();
        if (one.name() != collection) continue;
        seen = true;
        EXPECT_EQ(one.shapes(), 2u);
        EXPECT_EQ(one.shapes_ready(), 1u);
        EXPECT_EQ(one.shapes_failed(), 1u);
    }
    EXPECT_TRUE(seen);
}

TEST_F(CollectionRpc, DeletingANonEmptyCollectionNeedsForce) {
    ASSERT_TRUE(addShape(client, headerFor(collection, "k", slowScan(20)), slowScan(20)).ok());
    pb::DeleteCollectionRequest request;
    request.set_name(collection);
    const auto refused = unary(*client.collections, &Stub::DeleteCollection, request);
    EXPECT_EQ(refused.status.error_code(), StatusCode::FAILED_PRECONDITION) << refused;
    EXPECT_EQ(refused.error, "rejected");
    EXPECT_TRUE(getShape(client, collection, "k").ok());
    request.set_force(true);
    ASSERT_TRUE(unary(*client.collections, &Stub::DeleteCollection, request).ok());
    EXPECT_EQ(getShape(client, collection, "k").error, "not_found");
    // Its running job ends with it, and the name is free again.
    EXPECT_TRUE(eventually([&] { return statsOf(client).running_jobs() == 0; }));
    EXPECT_EQ(statsOf(client).queued_jobs(), 0u);
    ASSERT_TRUE(createCollection(client, collection).ok());
    EXPECT_TRUE(listAll(client, collection).empty());
}

TEST_F(CollectionRpc, DeletingNeedsAName) {
    const auto reply = unary(*client.collections, &Stub::DeleteCollection, pb::DeleteCollectionRequest());
    EXPECT_EQ(reply.status.error_code(), StatusCode::INVALID_ARGUMENT) << reply;
}

TEST_F(CollectionRpc, CollectionsAreIndependent) {
    const std::string other = collection + "-other";
    ASSERT_TRUE(createCollection(client, other).ok());
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell(1)).ok());
    ASSERT_TRUE(addAndWait(client, other, "k", dumbbell(2)).ok());
    const auto found = searchByScan(client, searchOptions(collection), dumbbell(3));
    ASSERT_TRUE(found.ok()) << found;
    ASSERT_EQ(found.value.hits_size(), 1);
    EXPECT_EQ(found.value.hits(0).shape().collection(), collection);
    EXPECT_EQ(found.value.hits(0).shape().sha256(), sha256Of(dumbbell(1)));
}

}  // namespace
}  // namespace shapedb::testing
