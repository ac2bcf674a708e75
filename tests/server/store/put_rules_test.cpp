// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/put_rules.h"

#include <gtest/gtest.h>

#include "tests/server/support/fixtures.h"

namespace shapedb::store {
namespace {

using namespace shapedb::testing;

/// A put of "cup" in "parts", and the shape that has the key (version 3) unless a test takes it away.
class PutRules : public ::testing::Test {
  protected:
    PutRules() : request(putRequest(1, "cup", taggedPoints(1.0f), {{"colour", "red"}})) {
        existing.version = 3;
        existing.checksum = request.scan.checksum();
        existing.metadata = request.metadata.set;
    }

    Result<PutOutcome> onFreeKey() { return decidePut(request, "parts", nullptr); }
    Result<PutOutcome> onTakenKey() { return decidePut(request, "parts", &existing); }
    void otherPoints() { existing.checksum[0] ^= 1; }
    void otherMetadata() { existing.metadata["colour"] = "blue"; }

    PutRequest request;
    Shape existing;
};

void expectError(const Error& error, ErrorCode code, const std::string& message) {
    EXPECT_EQ(error.code, code);
    EXPECT_EQ(error.message, message);
}

TEST_F(PutRules, PointsWeighMoreThanMetadata) {
    EXPECT_EQ(onFreeKey().value(), PutOutcome::kCreated);
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    otherMetadata();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kMetadataChanged);
    otherPoints();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced);
    existing.metadata = request.metadata.set;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced);
}

TEST_F(PutRules, TheSamePointsElsewhereAreOtherPoints) {
    existing.origin = {1.0, 0.0, 0.0};
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced);
    existing.state = ShapeState::kFailed;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced) << "no retry of the others";
    request.mode = PutMode::kSamePoints;
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kAlreadyExists);
    request.mode = PutMode::kInsertOnly;
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kAlreadyExists);
}

TEST_F(PutRules, InsertOnlyAcceptsARepeatedRequest) {
    request.mode = PutMode::kInsertOnly;
    EXPECT_EQ(onFreeKey().value(), PutOutcome::kCreated);
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    const std::string taken =
        "shape 'cup' already exists in collection 'parts' with other points or metadata";
    otherMetadata();
    expectError(onTakenKey().error(), ErrorCode::kAlreadyExists, taken);
    existing.metadata = request.metadata.set;
    otherPoints();
    expectError(onTakenKey().error(), ErrorCode::kAlreadyExists, taken);
}

TEST_F(PutRules, UpdateOnlyNeedsTheShape) {
    request.mode = PutMode::kUpdateOnly;
    expectError(onFreeKey().error(), ErrorCode::kNotFound, "there is no shape 'cup' in collection 'parts'");
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    otherPoints();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced);
}

TEST_F(PutRules, SamePointsDoesNotReplaceOthers) {
    request.mode = PutMode::kSamePoints;
    EXPECT_EQ(onFreeKey().value(), PutOutcome::kCreated);
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    otherMetadata();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kMetadataChanged);
    otherPoints();
    expectError(onTakenKey().error(), ErrorCode::kAlreadyExists,
                "shape 'cup' already exists in collection 'parts' with other points");
    existing.state = ShapeState::kFailed;
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kAlreadyExists);
}

TEST_F(PutRules, WhatDoesNotChangeTheMetadataIsARepetition) {
    request.metadata = {};
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged) << "none given";
    request.mode = PutMode::kInsertOnly;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    request.mode = PutMode::kUpsert;
    request.metadata = {{{"colour", "red"}}, {"size"}, false};
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    request.metadata = {{}, {"colour"}, false};
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kMetadataChanged);
    request.metadata = replacedBy({});
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kMetadataChanged);
}

TEST_F(PutRules, TheMetadataThatTheShapeWouldHaveAreChecked) {
    std::vector<Metadata> asked;
    request.checkMetadata = [&](const Metadata& metadata) -> Result<void> {
        asked.push_back(metadata);
        if (metadata.size() < 2) return {};
        return fail(ErrorCode::kInvalidArgument, "too many");
    };
    EXPECT_TRUE(onTakenKey());
    request.metadata = {{{"size", "3"}}, {}, false};
    EXPECT_TRUE(onFreeKey());
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kInvalidArgument);
    ASSERT_EQ(asked.size(), 3u);
    EXPECT_EQ(asked[1], (Metadata{{"size", "3"}}));
    EXPECT_EQ(asked[2], (Metadata{{"colour", "red"}, {"size", "3"}}));
}

TEST(MetadataChange, SetsRemovesAndReplaces) {
    const Metadata before = {{"a", "1"}, {"b", "2"}};
    EXPECT_EQ(MetadataChange().of(before), before);
    EXPECT_EQ((MetadataChange{{{"b", "3"}, {"c", "4"}}, {"a", "x"}, false}).of(before),
              (Metadata{{"b", "3"}, {"c", "4"}}));
    EXPECT_EQ(replacedBy({{"c", "4"}}).of(before), (Metadata{{"c", "4"}}));
    EXPECT_EQ(replacedBy({}).of(before), Metadata());
}

TEST_F(PutRules, AFailedShapeIsTriedAgain) {
    existing.state = ShapeState::kFailed;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kRetried);
    request.mode = PutMode::kInsertOnly;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kRetried);
    request.mode = PutMode::kUpsert;
    otherMetadata();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kRetried) << "with its new metadata";
    otherPoints();
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kReplaced);
}

TEST_F(PutRules, ARepeatedRequestWhoseReplyWasLostIsRecognised) {
    request.expectedVersion = 2;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged) << "it made version 3";
    otherMetadata();
    expectError(onTakenKey().error(), ErrorCode::kVersionConflict,
                "shape 'cup' has version 3, not the expected version 2");
}

TEST_F(PutRules, ExpectedVersionHoldsForRepeatedRequestsToo) {
    request.expectedVersion = 3;
    EXPECT_EQ(onTakenKey().value(), PutOutcome::kUnchanged);
    expectError(onFreeKey().error(), ErrorCode::kVersionConflict,
                "shape 'cup' does not exist (version 0), not the expected version 3");
    request.expectedVersion = 1;
    expectError(onTakenKey().error(), ErrorCode::kVersionConflict,
                "shape 'cup' has version 3, not the expected version 1");
    request.expectedVersion = 0;
    EXPECT_EQ(onFreeKey().value(), PutOutcome::kCreated);
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kVersionConflict);
}

TEST_F(PutRules, TheModeIsLookedAtBeforeTheVersion) {
    request.expectedVersion = 2;
    request.mode = PutMode::kUpdateOnly;
    EXPECT_EQ(onFreeKey().error().code, ErrorCode::kNotFound);
    request.mode = PutMode::kInsertOnly;
    otherPoints();
    EXPECT_EQ(onTakenKey().error().code, ErrorCode::kAlreadyExists);
}

TEST_F(PutRules, TheQueueHoldsAtMostItsLimits) {
    const auto room = [&](const QueueDepth& others) {
        return requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes, others);
    };
    ASSERT_EQ(request.scan.bytes(), 48u);
    EXPECT_TRUE(room({1000, 1000})) << "no limits";
    request.maxQueuedJobs = 3;
    EXPECT_TRUE(room({2, 1000}));
    expectError(room({3, 0}).error(), ErrorCode::kQueueFull,
                "the ingest queue is full (3 of 3 scans, ingest.max_queued_jobs); retry later");
    request.maxQueuedBytes = 100;
    EXPECT_TRUE(room({2, 52}));
    expectError(room({2, 53}).error(), ErrorCode::kQueueFull,
                "the ingest queue has no room for 48 more bytes (53 of 100 bytes taken, "
                "ingest.max_queued_bytes); retry later");
}

}  // namespace
}  // namespace shapedb::store
