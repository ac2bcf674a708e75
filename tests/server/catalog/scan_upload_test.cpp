// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/scan_upload.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb::catalog {
namespace {

class ScanUploadTest : public ::testing::Test {
  protected:
    static std::vector<float> somePoints(std::size_t count) {
        Random random(count);
        std::vector<float> xyz(3 * count);
        for (float& c : xyz) c = static_cast<float>(random.uniform(-10.0, 10.0));
        return xyz;
    }

    static std::string bytes(const std::vector<float>& xyz) {
        std::string text(xyz.size() * 4, '\0');
        std::memcpy(text.data(), xyz.data(), text.size());
        return text;
    }

    static void expectError(const Result<void>& result, ErrorCode code, const std::string& word = "") {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, code) << result.error().message;
        EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
    }

    Budget budget{1 << 20, "bytes"};
};

TEST_F(ScanUploadTest, ReturnsThePointsSent) {
    const auto xyz = somePoints(1'000);
    const std::string all = bytes(xyz);
    const Sha256Digest digest = sha256(all.data(), all.size());
    for (const std::size_t chunk : {1u, 7u, 999u, 1'000u}) {
        ScanUpload receiver(1'000, budget);
        ASSERT_TRUE(receiver.begin(1'000, std::string(digest.begin(), digest.end())));
        for (std::size_t at = 0; at < all.size(); at += 12 * chunk) {
            ASSERT_TRUE(receiver.add(all.substr(at, 12 * chunk)));
        }
        const auto scan = receiver.finish();
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_EQ(scan->points(), xyz);
        EXPECT_EQ(scan->checksum(), digest);
    }
}

TEST_F(ScanUploadTest, RefusesABadHeader) {
    expectError(ScanUpload(10, budget).begin(0, ""), ErrorCode::kTooFewPoints, "0 points");
    expectError(ScanUpload(10, budget).begin(3, ""), ErrorCode::kTooFewPoints);
    EXPECT_TRUE(ScanUpload(10, budget).begin(4, ""));
    EXPECT_TRUE(ScanUpload(10, budget).begin(10, ""));
    expectError(ScanUpload(10, budget).begin(11, ""), ErrorCode::kPointLimitExceeded, "at most 10");
    expectError(ScanUpload(10, budget).begin(~std::uint64_t{0}, ""), ErrorCode::kPointLimitExceeded);
    expectError(ScanUpload(10, budget).begin(4, std::string(31, 'x')), ErrorCode::kInvalidArgument, "31");
}

TEST_F(ScanUploadTest, RefusesMessagesOutOfOrder) {
    const std::string four = bytes(somePoints(4));
    ScanUpload headless(10, budget);
    expectError(headless.add(four), ErrorCode::kMalformedStream, "before the header");
    ScanUpload empty(10, budget);
    EXPECT_EQ(empty.finish().error().code, ErrorCode::kMalformedStream);
    ScanUpload twice(10, budget);
    ASSERT_TRUE(twice.begin(4, ""));
    expectError(twice.begin(4, ""), ErrorCode::kMalformedStream, "a second header arrived");
    ScanUpload after(10, budget);
    ASSERT_TRUE(after.begin(4, ""));
    ASSERT_TRUE(after.add(four));
    expectError(after.add(four), ErrorCode::kMalformedStream, "already come");
}

TEST_F(ScanUploadTest, RefusesChunksThatAreNotWholePointsOrTooLong) {
    for (const std::size_t size : {0u, 1u, 11u, 13u, 47u}) {
        ScanUpload receiver(100'000, budget);
        ASSERT_TRUE(receiver.begin(100, ""));
        expectError(receiver.add(std::string(size, '\0')), ErrorCode::kMalformedStream);
    }
    ScanUpload receiver(1'000'000, budget);
    ASSERT_TRUE(receiver.begin(500'000, ""));
    EXPECT_TRUE(receiver.add(std::string(12 * 87'381, '\0'))) << "the largest multiple of 12 up to 1 MiB";
    expectError(receiver.add(std::string(12 * 87'382, '\0')), ErrorCode::kMalformedStream, "1048576");
}

TEST_F(ScanUploadTest, RefusesAnotherCountThanAnnounced) {
    const std::string three = bytes(somePoints(3));
    ScanUpload more(10, budget);
    ASSERT_TRUE(more.begin(5, ""));
    ASSERT_TRUE(more.add(three));
    expectError(more.add(three), ErrorCode::kCountMismatch, "5");
    ScanUpload fewer(10, budget);
    ASSERT_TRUE(fewer.begin(5, ""));
    ASSERT_TRUE(fewer.add(three));
    EXPECT_EQ(fewer.finish().error().code, ErrorCode::kCountMismatch);
}

TEST_F(ScanUploadTest, DetectsEveryFlippedBit) {
    const std::string all = bytes(somePoints(4));
    const Sha256Digest digest = sha256(all.data(), all.size());
    for (std::size_t bit = 0; bit < 8 * all.size(); ++bit) {
        std::string flipped = all;
        flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
        ScanUpload receiver(10, budget);
        ASSERT_TRUE(receiver.begin(4, std::string(digest.begin(), digest.end())));
        if (!receiver.add(flipped)) continue;  // it became infinite
        EXPECT_EQ(receiver.finish().error().code, ErrorCode::kChecksumMismatch) << bit;
    }
}

TEST_F(ScanUploadTest, NamesNonFiniteCoordinates) {
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (const float value : bad) {
        for (const std::size_t at : {0u, 10u, 299u}) {
            auto xyz = somePoints(100);
            xyz[at] = value;
            ScanUpload receiver(2'000, budget);
            ASSERT_TRUE(receiver.begin(1'100, ""));
            ASSERT_TRUE(receiver.add(bytes(somePoints(1'000))));
            const std::string axis(1, "xyz"[at % 3]);
            expectError(receiver.add(bytes(xyz)), ErrorCode::kNonFiniteCoordinate,
                        "point " + std::to_string(1'000 + at / 3) + ": " + axis);
        }
    }
}

TEST_F(ScanUploadTest, BoundsTheMemoryOfAllUploads) {
    Budget small(24'000, "bytes");  // 2,000 points
    ScanUpload first(10'000, small);
    ASSERT_TRUE(first.begin(2'000, ""));
    ASSERT_TRUE(first.add(bytes(somePoints(1'500))));
    {
        ScanUpload second(10'000, small);
        ASSERT_TRUE(second.begin(2'000, ""));
        ASSERT_TRUE(second.add(bytes(somePoints(500))));
        expectError(second.add(bytes(somePoints(1))), ErrorCode::kQueueFull, "24000");
    }
    EXPECT_TRUE(first.add(bytes(somePoints(500)))) << "the second upload's share was returned";
    // Announcing a billion points takes no budget.
    ScanUpload liar(2'000'000'000, small);
    EXPECT_TRUE(liar.begin(1'000'000'000, ""));
}

}  // namespace
}  // namespace shapedb::catalog
