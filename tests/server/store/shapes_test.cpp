// SPDX-License-Identifier: GPL-3.0-or-later
#include <atomic>
#include <set>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

using ShapesTest = EachStoreTest;

TEST_P(ShapesTest, PutStoresEverythingAndQueuesAJob) {
    const Collection c = collection();
    const auto points = cloud(1, 500);
    const PutResult put =
        store_->putShape(request(c.id, "cup", points, {{"label", "cup"}, {"b", "2"}})).value();
    EXPECT_EQ(put.outcome, PutOutcome::kCreated);
    EXPECT_EQ(put.shape.version, 1);
    EXPECT_EQ(put.shape.pointsVersion, 1);
    EXPECT_EQ(put.shape.state, ShapeState::kPending);
    EXPECT_EQ(put.shape.pointCount, 500u);
    EXPECT_EQ(put.shape.checksum, checksumOf(points));
    EXPECT_EQ(put.shape.metadata, (Metadata{{"b", "2"}, {"label", "cup"}}));
    EXPECT_FALSE(put.shape.failure);
    EXPECT_TRUE(store_->getShape(c.id, "cup").value() == put.shape);
    EXPECT_TRUE(store_->getShapeById(put.shape.id).value() == put.shape);
    EXPECT_EQ(store_->loadPoints(put.shape.id)->xyz, points);
    EXPECT_EQ(store_->queueDepth()->jobs, 1u);
    EXPECT_EQ(store_->queueDepth()->bytes, 6000u);
    open();
    EXPECT_TRUE(store_->getShape(c.id, "cup").value() == put.shape);
    EXPECT_EQ(store_->loadPoints(put.shape.id)->xyz, points);
}

TEST_P(ShapesTest, KeepsWhatPointsAreRelativeTo) {
    const Collection c = collection();
    const auto points = cloud(1);
    const Point3 site{4.4e6 + 1.0 / 3.0, -5.2e6, 0.1};
    const Point3 limit{-3.3e38, 1e-300, 5e-324};
    const PutResult put = store_->putShape(request(c.id, "far", points, {{"label", "cup"}}, site)).value();
    EXPECT_EQ(put.shape.origin, site);
    EXPECT_EQ(put.shape.checksum, checksumOf(points)) << "of the points alone";
    finishAll();
    open();
    const Shape stored = store_->getShape(c.id, "far").value();
    EXPECT_EQ(stored.origin, site) << "to the last bit";
    EXPECT_EQ(stored.metadata, (Metadata{{"label", "cup"}}));
    EXPECT_EQ(store_->listShapes(c.id, 0, 10, {})->front().origin, site);
    EXPECT_EQ(store_->loadPoints(stored.id)->origin, site);
    EXPECT_EQ(store_->loadPoints(stored.id)->xyz, points);
    EXPECT_EQ(store_->putShape(request(c.id, "far", points, {{"label", "cup"}}, site))->outcome,
              PutOutcome::kUnchanged);

    const PutResult moved = store_->putShape(request(c.id, "far", points, {{"label", "cup"}})).value();
    EXPECT_EQ(moved.outcome, PutOutcome::kReplaced);
    EXPECT_EQ(moved.shape.origin, Point3{});
    EXPECT_EQ(moved.shape.pointsVersion, 2);
    EXPECT_EQ(moved.shape.state, ShapeState::kPending);
    EXPECT_EQ(store_->loadPoints(stored.id)->origin, Point3{});
    std::vector<float> huge = points;
    for (float& value : huge) value *= 1e37f;
    EXPECT_EQ(store_->putShape(request(c.id, "far", huge, {}, limit))->shape.origin, limit);
    finishAll();
    expectSound();
}

// Above PointEncoding::kWholeBytes: written into the row in pieces.
TEST_P(ShapesTest, StoresAndReplacesLargeScans) {
    const Collection c = collection();
    for (const std::size_t count : {800'000, 900'000}) {
        const auto points = cloud(count, count);
        const auto put = store_->putShape(request(c.id, "large", points));
        ASSERT_TRUE(put) << put.error().message;
        EXPECT_EQ(store_->loadPoints(put->shape.id)->xyz, points);
        EXPECT_EQ(store_->stats()->pointBytes, 12 * count);
        EXPECT_LT(store_->stats()->storedPointBytes, 12 * count);
        EXPECT_EQ(store_->putShape(request(c.id, "large", points))->outcome, PutOutcome::kUnchanged);
        open();
        EXPECT_EQ(store_->loadPoints(put->shape.id)->xyz, points);
    }
    finishAll();
    expectSound();
}

TEST_P(ShapesTest, RepeatedRequestChangesNothingButTriesAFailedShapeAgain) {
    const Collection c = collection();
    const auto points = cloud(1);
    for (const bool failed : {false, true}) {
        const Shape first = put(c.id, failed ? "f" : "r", 1, {{"a", "1"}});
        if (failed) {
            ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kCoplanar, "flat"}));
        } else {
            finishAll();
        }
        const Shape before = store_->getShapeById(first.id).value();
        for (const PutMode mode : {PutMode::kUpsert, PutMode::kInsertOnly, PutMode::kUpdateOnly}) {
            PutRequest again = request(c.id, first.key, points, {{"a", "1"}});
            again.mode = mode;
            const PutResult result = store_->putShape(again).value();
            if (failed) {
                EXPECT_EQ(result.outcome, PutOutcome::kRetried);
                EXPECT_EQ(result.shape.version, before.version);
                EXPECT_EQ(result.shape.state, ShapeState::kPending);
                ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kCoplanar, "flat"}));
                continue;
            }
            EXPECT_EQ(result.outcome, PutOutcome::kUnchanged);
            EXPECT_TRUE(result.shape == before);
            EXPECT_EQ(result.shape.updatedAt, before.updatedAt);
        }
        EXPECT_EQ(store_->queueDepth()->jobs, 0u);
    }
}

TEST_P(ShapesTest, OtherMetadataNeedsNoJob) {
    const Collection c = collection();
    put(c.id, "cup", 1, {{"a", "1"}, {"b", "2"}});
    finishAll();
    const auto points = cloud(1);
    const PutResult result = store_->putShape(request(c.id, "cup", points, {{"b", "3"}})).value();
    EXPECT_EQ(result.outcome, PutOutcome::kMetadataChanged);
    EXPECT_EQ(result.shape.version, 2);
    EXPECT_EQ(result.shape.pointsVersion, 1);
    EXPECT_EQ(result.shape.state, ShapeState::kReady);
    EXPECT_EQ(result.shape.metadata, (Metadata{{"b", "3"}}));
    EXPECT_EQ(store_->queueDepth()->jobs, 0u);
    EXPECT_EQ(store_->getSignature(result.shape.id)->pointsVersion, 1);
    expectSound();
}

TEST_P(ShapesTest, OtherPointsServeTheOldSignatureUntilTheJobEnds) {
    const Collection c = collection();
    const Shape first = put(c.id, "cup", 1);
    finishAll();
    const Shape second = put(c.id, "cup", 2);
    EXPECT_EQ(second.id, first.id);
    EXPECT_EQ(second.version, 2);
    EXPECT_EQ(second.pointsVersion, 2);
    EXPECT_EQ(second.state, ShapeState::kPending);
    EXPECT_EQ(store_->getSignature(first.id)->pointsVersion, 1);
    EXPECT_EQ(store_->loadPoints(first.id)->xyz, cloud(2));
    const auto rows = store_->loadIndex(c.id, 0, 10).value();
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0].signature.pointsVersion, 1);
    EXPECT_EQ(store_->getShapeById(rows[0].shapeId)->pointsVersion, 2);
    put(c.id, "cup", 3);
    EXPECT_EQ(store_->queueDepth()->jobs, 1u) << "the job of the second points is replaced";
    finishAll();
    EXPECT_EQ(store_->getSignature(first.id)->bytes, signatureFor(first.id, 3, 1).bytes);
    put(c.id, "cup", 4);
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kTooFewPoints, "three"}));
    EXPECT_FAILS(store_->getSignature(first.id), ErrorCode::kNotReady);
    EXPECT_EQ(store_->getShapeById(first.id)->failure->message, "three");
    put(c.id, "cup", 5);
    EXPECT_FALSE(store_->getShapeById(first.id)->failure);
    EXPECT_EQ(store_->stats()->signatures, 0u);
    expectSound();
}

TEST_P(ShapesTest, ObeysModesAndExpectedVersions) {
    const Collection c = collection();
    const auto one = cloud(1);
    const auto two = cloud(2);
    PutRequest update = request(c.id, "cup", one);
    update.mode = PutMode::kUpdateOnly;
    EXPECT_FAILS(store_->putShape(update), ErrorCode::kNotFound);
    PutRequest expected = request(c.id, "cup", one);
    expected.expectedVersion = 3;
    EXPECT_FAILS(store_->putShape(expected), ErrorCode::kVersionConflict);
    expected.expectedVersion = 0;
    EXPECT_EQ(store_->putShape(expected)->outcome, PutOutcome::kCreated);
    EXPECT_EQ(store_->putShape(expected)->outcome, PutOutcome::kUnchanged) << "the reply was lost";

    PutRequest insert = request(c.id, "cup", two);
    insert.mode = PutMode::kInsertOnly;
    EXPECT_FAILS(store_->putShape(insert), ErrorCode::kAlreadyExists);
    insert = request(c.id, "cup", one, {{"a", "1"}});
    insert.mode = PutMode::kInsertOnly;
    EXPECT_FAILS(store_->putShape(insert), ErrorCode::kAlreadyExists);

    PutRequest replace = request(c.id, "cup", two);
    replace.expectedVersion = 2;
    const auto conflict = store_->putShape(replace);
    ASSERT_FALSE(conflict);
    EXPECT_EQ(conflict.error().message, "shape 'cup' has version 1, not the expected version 2");
    replace.expectedVersion = 1;
    EXPECT_EQ(store_->putShape(replace)->shape.version, 2);

    EXPECT_FAILS(store_->deleteShape(c.id, "cup", 1), ErrorCode::kVersionConflict);
    EXPECT_EQ(store_->deleteShape(c.id, "cup", 2)->version, 2);
    EXPECT_EQ(store_->deleteShape(c.id, "cup", 2)->version, 2) << "as a call whose reply was lost";
    EXPECT_FAILS(store_->deleteShape(c.id, "cup", 1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->deleteShape(c.id, "cup", std::nullopt), ErrorCode::kNotFound);
}

TEST_P(ShapesTest, ReportsWhatIsNotFound) {
    const Collection c = collection();
    const auto points = cloud(1);
    EXPECT_FAILS(store_->putShape(request(99, "cup", points)), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->getShape(c.id, "cup"), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->getShape(99, "cup"), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->getShapeById(1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->loadPoints(1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->getSignature(1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->loadIndex(99, 0, 1), ErrorCode::kNotFound);
    const Shape shape = put(c.id, "cup", 1);
    EXPECT_FAILS(store_->getSignature(shape.id), ErrorCode::kNotReady);
}

TEST_P(ShapesTest, FullQueueStoresNothing) {
    const Collection c = collection();
    const auto a = cloud(1);
    const auto b = cloud(2);
    const auto bounded = [&](const std::string& key, const std::vector<float>& points, std::uint64_t jobs,
                             std::uint64_t bytes) {
        PutRequest put = request(c.id, key, points);
        put.maxQueuedJobs = jobs;
        put.maxQueuedBytes = bytes;
        return store_->putShape(put);
    };
    EXPECT_FAILS(bounded("a", a, 0, 95), ErrorCode::kQueueFull);
    EXPECT_TRUE(bounded("a", a, 1, 96));
    EXPECT_FAILS(bounded("b", b, 1, 0), ErrorCode::kQueueFull);
    EXPECT_FAILS(bounded("b", b, 0, 191), ErrorCode::kQueueFull);
    EXPECT_FAILS(store_->getShape(c.id, "b"), ErrorCode::kNotFound);
    EXPECT_EQ(bounded("a", a, 1, 96)->outcome, PutOutcome::kUnchanged) << "no job, no bound";
    EXPECT_EQ(bounded("a", b, 1, 96)->outcome, PutOutcome::kReplaced) << "its own job leaves the queue first";
    const Job job = claim();
    EXPECT_FAILS(bounded("b", b, 1, 0), ErrorCode::kQueueFull);  // running jobs count
    ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
    EXPECT_TRUE(bounded("b", b, 1, 96));
    EXPECT_FAILS(bounded("a", a, 1, 0), ErrorCode::kQueueFull);
    EXPECT_EQ(store_->getShape(c.id, "a")->version, 2) << "a refused replacement changes nothing";
    EXPECT_EQ(store_->loadPoints(store_->getShape(c.id, "a")->id)->xyz, b);
    expectSound();
}

TEST_P(ShapesTest, PagesAreStableAndFiltered) {
    const Collection c = collection();
    const Collection other = collection("other");
    for (int i = 0; i < 40; ++i) {
        put(c.id, "k" + std::to_string(i), 100 + i, {{"parity", i % 2 ? "odd" : "even"}, {"x", "y"}});
        put(other.id, "k" + std::to_string(i), 100 + i);
    }
    for (int i = 0; i < 10; ++i) {
        const Job job = claim();
        ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
    }
    const auto pages = [&](const ShapeFilter& filter, std::size_t limit) {
        std::vector<std::string> keys;
        std::int64_t after = 0;
        while (true) {
            const auto page = store_->listShapes(c.id, after, limit, filter).value();
            EXPECT_LE(page.size(), limit);
            for (const Shape& shape : page) {
                EXPECT_GT(shape.id, after);
                EXPECT_EQ(shape.metadata.size(), 2u);
                after = shape.id;
                keys.push_back(shape.key);
            }
            if (page.size() < limit) return keys;
        }
    };
    EXPECT_EQ(pages({}, 7).size(), 40u);
    EXPECT_EQ(pages({ShapeState::kReady, nullptr}, 2).size(), 5u);
    ShapeFilter odd;
    odd.accept = [](const Shape& shape) { return shape.metadata.at("parity") == "odd"; };
    const auto keys = pages(odd, 3);
    EXPECT_EQ(keys.size(), 20u);
    for (const auto& key : keys) EXPECT_EQ((key.back() - '0') % 2, 1) << key;
    EXPECT_EQ(store_->countShapes(c.id, odd).value(), 20u);
    EXPECT_EQ(store_->countShapes(c.id, {}).value(), 40u);
    EXPECT_EQ(store_->countShapes(c.id, {ShapeState::kPending, nullptr}).value(), 35u);
    odd.state = ShapeState::kReady;
    EXPECT_EQ(store_->countShapes(c.id, odd).value(), 2u);
    EXPECT_TRUE(store_->listShapes(c.id, 0, 0, {})->empty());

    // A filter that throws is a bug, but does not end the process.
    ShapeFilter bad;
    bad.accept = [](const Shape&) -> bool { throw std::runtime_error("broken filter"); };
    EXPECT_FAILS(store_->listShapes(c.id, 0, 5, bad), ErrorCode::kInternal);
    EXPECT_EQ(store_->listShapes(c.id, 0, 5, {})->size(), 5u);
}

TEST_P(ShapesTest, ACancelledListingReadsNoFurther) {
    const Collection c = collection();
    for (int i = 0; i < 40; ++i) put(c.id, "k" + std::to_string(i), 100 + i);
    std::atomic<bool> cancel{false};
    int read = 0;
    ShapeFilter filter;
    filter.context.cancel = &cancel;
    filter.accept = [&](const Shape&) {
        cancel = ++read == 5;
        return false;
    };
    EXPECT_FAILS(store_->listShapes(c.id, 0, 10, filter), ErrorCode::kCancelled);
    EXPECT_EQ(read, 5);
    cancel = false;
    read = 0;
    EXPECT_FAILS(store_->countShapes(c.id, filter), ErrorCode::kCancelled);
    EXPECT_EQ(read, 5);
    cancel = false;
    filter.context.deadline = RunContext::Clock::now();
    EXPECT_FAILS(store_->listShapes(c.id, 0, 10, filter), ErrorCode::kDeadlineExceeded);
    EXPECT_EQ(store_->listShapes(c.id, 0, 50, {})->size(), 40u) << "the connection serves the next read";
}

TEST_P(ShapesTest, LoadsTheIndexInPages) {
    const Collection c = collection();
    for (int i = 0; i < 9; ++i)
        put(c.id, "k" + std::to_string(i), 100 + i, {{"n", std::to_string(i)}, {"m", ""}});
    for (int i = 0; i < 7; ++i) {
        const Job job = claim();
        ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
    }
    std::int64_t after = 0;
    std::size_t total = 0;
    while (true) {
        const auto rows = store_->loadIndex(c.id, after, 3).value();
        for (const IndexRow& row : rows) {
            EXPECT_EQ(row.signature.bytes, signatureFor(row.shapeId, 1, 1).bytes);
            EXPECT_EQ(row.signature.shapeId, row.shapeId);
            EXPECT_EQ("k" + row.metadata.at("n"), store_->getShapeById(row.shapeId)->key);
            EXPECT_EQ(row.metadata.size(), 2u);
            after = row.shapeId;
        }
        total += rows.size();
        if (rows.size() < 3) break;
    }
    EXPECT_EQ(total, 7u);
}

TEST_P(ShapesTest, ARefusedCheckOfTheMetadataStoresNothing) {
    const Collection c = collection();
    const Shape before = put(c.id, "cup", 1, {{"label", "cup"}});
    PutRequest refused = request(c.id, "cup", cloud(2));
    refused.metadata = {{{"size", "3"}}, {}, false};
    refused.checkMetadata = [](const Metadata& metadata) -> Result<void> {
        return fail(ErrorCode::kInvalidArgument, std::to_string(metadata.size()) + " entries");
    };
    const auto result = store_->putShape(refused);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message, "2 entries");
    EXPECT_TRUE(store_->getShape(c.id, "cup").value() == before);
    EXPECT_EQ(store_->loadPoints(before.id)->xyz, cloud(1));
    expectSound();
}

SHAPEDB_ON_EACH_ENGINE(ShapesTest);

}  // namespace
}  // namespace shapedb::store
