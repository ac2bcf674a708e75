// SPDX-License-Identifier: GPL-3.0-or-later
// What is sent to somebody who wants to look at shapes, on a live server.
#include <string>
#include <string_view>

#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using Viewing = LiveTest;

TEST_F(Viewing, FewerPointsAreThoseOfTheScanWithTheirSegments) {
    const Scan scan = dumbbell(4, 5'000);
    ASSERT_TRUE(addAndWait(client, collection, "k", scan).ok());
    const std::string all = bytesOf(scan);

    pb::GetSegmentsRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("k");
    const auto segmentsOf = [&](std::uint64_t most) {
        request.set_max_points(most);
        CallContext context;
        const auto reader = client.shapes->GetSegments(&context, request);
        const auto sent = testing::drain(context, *reader);
        EXPECT_EQ(sent.messages.size(), 2u) << sent;
        return sent.messages.back().chunk();
    };
    const pb::LabelledChunk whole = segmentsOf(0);
    const pb::LabelledChunk some = segmentsOf(100);
    EXPECT_EQ(whole.segments_size(), 5'000);
    ASSERT_EQ(some.segments_size(), 100);
    int point = 0;
    for (int i = 0; i < some.segments_size(); ++i, ++point) {
        while (point < whole.segments_size() && std::string_view(all).substr(12 * point, 12) !=
                                                    std::string_view(some.xyz()).substr(12 * i, 12)) {
            ++point;
        }
        ASSERT_LT(point, whole.segments_size()) << "point " << i << " is not of the scan, or out of order";
        EXPECT_EQ(some.segments(i), whole.segments(point));
    }

    pb::GetPointsRequest points;
    *points.mutable_shape() = request.shape();
    points.set_max_points(100);
    CallContext context;
    const auto reader = client.shapes->GetPoints(&context, points);
    const auto sent = testing::drain(context, *reader);
    ASSERT_TRUE(sent.ok()) << sent;
    ASSERT_EQ(sent.messages.size(), 2u);
    EXPECT_EQ(sent.messages[0].shape().point_count(), 5'000u);
    EXPECT_EQ(sent.messages[1].chunk().xyz(), some.xyz());
}

TEST_F(Viewing, PreviewsAreOfTheShapesThatAreThereAndCoarserOnDemand) {
    const Scan scan = dumbbell(4, 5'000);
    ASSERT_TRUE(addAndWait(client, collection, "a", scan).ok());
    ASSERT_TRUE(addAndWait(client, collection, "b", scan).ok());
    pb::GetPreviewsRequest request;
    request.set_collection(collection);
    for (const char* key : {"b", "missing", "a"}) request.add_keys(key);
    pb::GetPreviewsResponse response;
    {
        CallContext context;
        ASSERT_TRUE(client.shapes->GetPreviews(&context, request, &response).ok());
    }
    ASSERT_EQ(response.previews_size(), 2);
    EXPECT_EQ(response.previews(0).key(), "b");
    EXPECT_EQ(response.previews(1).key(), "a");
    const pb::Preview& preview = response.previews(0);
    EXPECT_EQ(preview.version(), 1);
    ASSERT_GE(preview.xyz().size(), 12u * 500);
    ASSERT_LE(preview.xyz().size(), 12u * 1'500);
    EXPECT_EQ(preview.normals().size(), preview.xyz().size() / 4);

    request.set_max_points(40);
    pb::GetPreviewsResponse few;
    CallContext context;
    ASSERT_TRUE(client.shapes->GetPreviews(&context, request, &few).ok());
    EXPECT_EQ(few.previews(0).xyz(), preview.xyz().substr(0, 12 * 40));
    EXPECT_EQ(few.previews(0).normals(), preview.normals().substr(0, 3 * 40));
}

}  // namespace
}  // namespace shapedb::testing
