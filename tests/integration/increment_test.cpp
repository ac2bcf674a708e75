// SPDX-License-Identifier: GPL-3.0-or-later
// Backup with a manifest, as any client may send it.
#include <filesystem>
#include <string>

#include "common/backup_increment.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

Stream<pb::BackupChunk> backupWith(Client& client, const pb::BackupRequest& request) {
    CallContext context;
    const auto reader = client.admin->Backup(&context, request);
    return testing::drain(context, *reader);
}

std::string bytesSent(const Stream<pb::BackupChunk>& stream) {
    std::string bytes;
    for (const pb::BackupChunk& chunk : stream.messages) bytes += chunk.data();
    return bytes;
}

pb::BackupRequest requestSince(std::uint64_t blocks, std::uint64_t blockBytes) {
    pb::BackupRequest request;
    pb::BackupManifest& manifest = *request.mutable_since();
    manifest.set_bytes(blocks * blockBytes);
    manifest.set_block_bytes(blockBytes);
    manifest.set_sha256(std::string(32, 's'));
    manifest.set_block_hashes(std::string(static_cast<std::size_t>(32 * blocks), 'h'));
    return request;
}

class IncrementRpc : public LiveTest {};

TEST_F(IncrementRpc, ABackupThatSharesNothingGivesEverything) {
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell(1)).ok());
    const std::string full = bytesSent(backupWith(client, pb::BackupRequest()));
    // The largest manifest there is fits a message; the blocks stay as large as in it.
    for (const std::uint64_t blockBytes : {4'096u, 1u << 20, 256u << 20}) {
        const auto stream = backupWith(client, requestSince(kMaxBackupBlocks, blockBytes));
        ASSERT_TRUE(stream.ok()) << stream;
        const std::string bytes = bytesSent(stream);
        EXPECT_EQ(stream.messages.front().total_bytes(), bytes.size());
        const auto headBytes = incrementHeadBytes(bytes, bytes.size());
        ASSERT_TRUE(headBytes) << headBytes.error().message;
        const auto head = decodeIncrementHead(bytes.substr(0, *headBytes), bytes.size());
        ASSERT_TRUE(head) << head.error().message;
        EXPECT_EQ(head->result.blockBytes, blockBytes);
        EXPECT_EQ(head->base.bytes, kMaxBackupBlocks * blockBytes);
        EXPECT_EQ(bytes.substr(*headBytes), full);
    }
    EXPECT_NE(readFile(directory()->path() + "/data/audit.log").find(std::string("\"since\":\"7373")),
              std::string::npos)
        << "an administrator's call, with what it was asked";
}

TEST_F(IncrementRpc, RefusesManifestsThatCannotBe) {
    const auto refused = [&](const pb::BackupRequest& request, const std::string& words) {
        const auto stream = backupWith(client, request);
        EXPECT_EQ(stream.error, "invalid_argument") << stream;
        EXPECT_NE(stream.status.error_message().find(words), std::string::npos) << stream;
        EXPECT_TRUE(stream.messages.empty());
    };
    pb::BackupRequest request;
    request.mutable_since();
    refused(request, "since: blocks of 0 bytes");
    refused(requestSince(3, 5'000), "power of two");
    refused(requestSince(0, 4'096), "whole number of pages");
    refused(requestSince(kMaxBackupBlocks + 1, 4'096), "more than 65536 blocks");
    request = requestSince(3, 4'096);
    request.mutable_since()->set_bytes(~std::uint64_t{4'095});
    refused(request, "more than 65536 blocks");
    request = requestSince(3, 4'096);
    request.mutable_since()->set_block_hashes("");
    refused(request, "block_hashes has 0 bytes, must be 96");
    request = requestSince(3, 4'096);
    request.mutable_since()->clear_sha256();
    refused(request, "sha256 has 0 bytes");
    EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(directory()->path() + "/data/tmp"); }));
    EXPECT_TRUE(backupWith(client, requestSince(3, 4'096)).ok()) << "the place of a copy is free";
}

}  // namespace
}  // namespace shapedb::testing
