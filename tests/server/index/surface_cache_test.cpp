// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/surface_cache.h"

#include <gtest/gtest.h>

#include "core/fit/surface_points_codec.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::index {
namespace {

using namespace shapedb::testing;

// A grid of points on a box of this size.
SurfacePoints boxSurface(double size) {
    PointCloud points;
    for (int i = 0; i < 8; ++i) {
        for (int j = 0; j < 8; ++j) {
            points.push_back({size * i, size * j, 0.0});
            points.push_back({size * i, size * j, size * 7.0});
        }
    }
    return makeSurfacePoints(points).value();
}

class SurfaceCacheTest : public ::testing::Test {
  protected:
    SurfaceCacheTest() {
        store.fault = [this](const std::string& function) -> std::optional<Error> {
            if (function == "getSurface") ++reads;
            return std::nullopt;
        };
        collection = store.createCollection("parts", "", "").value().id;
    }

    /// Stores a scan with surface points of this size, or without any. Returns its id.
    std::int64_t put(const std::string& key, double size) {
        store::PutRequest request(
            store::VerifiedScan::verify(taggedPoints(static_cast<float>(size))).value());
        request.collectionId = collection;
        request.key = key;
        EXPECT_TRUE(store.putShape(request));
        const store::Job job = **store.claimJob();
        store::SignatureRow row{job.shapeId, job.pointsVersion, job.generation, "signature"};
        if (size > 0.0) row.surface = encodeSurfacePoints(boxSurface(size));
        EXPECT_TRUE(store.finishJob(job, row));
        return job.shapeId;
    }

    MemoryStore store;
    std::int64_t collection = 0;
    int reads = 0;
};

TEST_F(SurfaceCacheTest, ReadsEachSurfaceOnce) {
    SurfaceCache cache(store);
    const auto id = put("a", 2.0);
    const auto first = cache.get(id);
    ASSERT_TRUE(first && *first);
    EXPECT_NEAR((*first)->unit, boxSurface(2.0).unit, 1e-12);
    EXPECT_EQ(*cache.get(id), *first);
    EXPECT_EQ(reads, 1);
}

TEST_F(SurfaceCacheTest, IsNullWithoutASurfaceAndForDeletedShapes) {
    SurfaceCache cache(store);
    const auto id = put("bare", 0.0);
    ASSERT_TRUE(cache.get(id));
    EXPECT_EQ(*cache.get(id), nullptr);
    ASSERT_TRUE(cache.get(id + 1));
    EXPECT_EQ(*cache.get(id + 1), nullptr);
}

TEST_F(SurfaceCacheTest, ReadsAgainAfterAChange) {
    SurfaceCache cache(store);
    const auto id = put("a", 2.0);
    ASSERT_TRUE(cache.get(id));
    ASSERT_EQ(put("a", 3.0), id);
    cache.forget(id);
    EXPECT_NEAR((*cache.get(id))->unit, boxSurface(3.0).unit, 1e-12);
    cache.clear();
    EXPECT_TRUE(*cache.get(id));
    EXPECT_EQ(reads, 3);
}

TEST_F(SurfaceCacheTest, DropsWhatWasNotUsedForLongest) {
    SurfaceCache cache(store, 2);
    const auto a = put("a", 1.0);
    const auto b = put("b", 2.0);
    const auto c = put("c", 3.0);
    for (const auto id : {a, b, a, c}) ASSERT_TRUE(cache.get(id));
    EXPECT_EQ(reads, 3);
    ASSERT_TRUE(cache.get(a));
    EXPECT_EQ(reads, 3) << "used after b";
    ASSERT_TRUE(cache.get(b));
    EXPECT_EQ(reads, 4);
}

TEST_F(SurfaceCacheTest, NamesTheShapeOfADamagedSurface) {
    SurfaceCache cache(store);
    const auto id = put("a", 2.0);
    ASSERT_TRUE(store.putShape([&] {
        store::PutRequest request(store::VerifiedScan::verify(taggedPoints(9.0f)).value());
        request.collectionId = collection;
        request.key = "a";
        return request;
    }()));
    const store::Job job = **store.claimJob();
    ASSERT_TRUE(store.finishJob(
        job, store::SignatureRow{job.shapeId, job.pointsVersion, job.generation, "signature", "damaged"}));
    const auto damaged = cache.get(id);
    ASSERT_FALSE(damaged);
    EXPECT_EQ(damaged.error().code, ErrorCode::kDataLoss);
    EXPECT_NE(damaged.error().message.find("shape " + std::to_string(id)), std::string::npos);
}

}  // namespace
}  // namespace shapedb::index
