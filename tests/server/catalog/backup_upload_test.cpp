// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/backup_upload.h"

#include <gtest/gtest.h>

#include "server/catalog/limits.h"

namespace shapedb::catalog {
namespace {

const std::string kNothing;

std::string checksumOf(const std::string& content) {
    const Sha256Digest digest = sha256(content.data(), content.size());
    return {digest.begin(), digest.end()};
}

Error errorOf(const Result<void>& result) {
    EXPECT_FALSE(result);
    return result ? Error{} : result.error();
}

TEST(BackupUpload, TakesPartsAndAChecksumOfItsOwn) {
    BackupUpload upload;
    EXPECT_TRUE(upload.add({6, "abc", kNothing}));
    EXPECT_TRUE(upload.add({0, "def", kNothing}));
    EXPECT_TRUE(upload.add({0, kNothing, checksumOf("abcdef")}));
    EXPECT_TRUE(upload.finish());
    EXPECT_EQ(upload.bytes(), 6u);
}

TEST(BackupUpload, TheChecksumMayComeWithTheLastData) {
    BackupUpload upload;
    EXPECT_TRUE(upload.add({3, "abc", checksumOf("abc")}));
    EXPECT_TRUE(upload.finish());
}

TEST(BackupUpload, RefusesMessagesOutOfOrder) {
    EXPECT_EQ(errorOf(BackupUpload().add({0, "abc", kNothing})).message,
              "backup after 0 bytes: the first message must say total_bytes");
    BackupUpload twice;
    ASSERT_TRUE(twice.add({6, "abc", kNothing}));
    const Error error = errorOf(twice.add({6, "def", kNothing}));
    EXPECT_EQ(error.code, ErrorCode::kMalformedStream);
    EXPECT_EQ(error.message, "backup after 3 bytes: total_bytes comes only in the first message");
    BackupUpload late;
    ASSERT_TRUE(late.add({3, "abc", checksumOf("abc")}));
    EXPECT_EQ(errorOf(late.add({0, "def", kNothing})).message,
              "backup after 3 bytes: message after the checksum, which comes last");
}

TEST(BackupUpload, RefusesMessagesOfTheWrongSize) {
    EXPECT_EQ(errorOf(BackupUpload().add({3, kNothing, kNothing})).message,
              "backup after 0 bytes: empty message");
    EXPECT_EQ(
        errorOf(BackupUpload().add({std::uint64_t{1} << 40, std::string(kMaxChunkBytes + 1, 'x'), kNothing}))
            .message,
        "backup after 0 bytes: chunk of 1048577 bytes, at most 1048576 are allowed");
    const Error more = errorOf(BackupUpload().add({3, "abcd", kNothing}));
    EXPECT_EQ(more.code, ErrorCode::kCountMismatch);
    EXPECT_EQ(more.message, "received more bytes than the 3 announced");
    const Error checksum = errorOf(BackupUpload().add({3, "abc", "short"}));
    EXPECT_EQ(checksum.code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(checksum.message, "sha256: 5 bytes, must be 32");
}

TEST(BackupUpload, RefusesAnIncompleteOrDamagedBackup) {
    EXPECT_EQ(errorOf(BackupUpload().finish()).message, "the stream ended before the first message");
    BackupUpload cut;
    ASSERT_TRUE(cut.add({6, "abc", kNothing}));
    const Error fewer = errorOf(cut.finish());
    EXPECT_EQ(fewer.code, ErrorCode::kCountMismatch);
    EXPECT_EQ(fewer.message, "3 bytes received, 6 were announced");
    BackupUpload unchecked;
    ASSERT_TRUE(unchecked.add({3, "abc", kNothing}));
    EXPECT_EQ(errorOf(unchecked.finish()).message, "the stream ended without a checksum");
    BackupUpload damaged;
    ASSERT_TRUE(damaged.add({3, "abc", checksumOf("abd")}));
    EXPECT_EQ(errorOf(damaged.finish()).code, ErrorCode::kChecksumMismatch);
}

}  // namespace
}  // namespace shapedb::catalog
