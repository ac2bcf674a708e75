// SPDX-License-Identifier: GPL-3.0-or-later
// Files of the server: backup and restore, export and import.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "client/api/client.h"
#include "common/sha256.h"
#include "tests/client/api/fake_server.h"
#include "tests/client/backup/backup_files.h"

namespace shapedb::client {
namespace {

namespace fs = std::filesystem;

std::string digestOf(const std::string& bytes) {
    const Sha256Digest digest = sha256(bytes.data(), bytes.size());
    return {digest.begin(), digest.end()};
}

class ClientBackup : public ::testing::Test {
  protected:
    ClientBackup()
        : folder_((fs::path(::testing::TempDir()) / ("backup-" + std::to_string(::getpid()))).string()) {
        fs::create_directories(folder_);
        v1::BackupChunk chunk;
        chunk.set_total_bytes(content_.size());
        chunk.set_data(content_.substr(0, 4));
        server_.admin.backup.push_back(chunk);
        chunk.Clear();
        chunk.set_data(content_.substr(4));
        chunk.set_sha256(digestOf(content_));
        server_.admin.backup.push_back(chunk);
    }
    ~ClientBackup() override { fs::remove_all(folder_); }

    std::string file() const { return folder_ + "/copy.db"; }
    std::string written() const {
        std::ifstream stream(file(), std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }
    bool nothingLeft() const { return fs::is_empty(folder_); }

    const std::string content_ = "all the shapes there are";
    std::string folder_;
    FakeServer server_;
};

TEST_F(ClientBackup, WritesTheCompleteFile) {
    const auto report = server_.client().backupToFile(file());
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->bytes, content_.size());
    EXPECT_EQ(report->sha256, digestOf(content_));
    EXPECT_EQ(written(), content_);
}

TEST_F(ClientBackup, DamagedOrShortBackupLeavesNoFile) {
    server_.admin.backup.back().set_data("otherwise");
    server_.admin.backup.front().set_total_bytes(13);
    EXPECT_EQ(server_.client().backupToFile(file()).error().code, ErrorCode::kChecksumMismatch);
    EXPECT_TRUE(nothingLeft());

    server_.admin.backup.pop_back();
    EXPECT_EQ(server_.client().backupToFile(file()).error().code, ErrorCode::kCountMismatch);
    EXPECT_TRUE(nothingLeft());
}

TEST_F(ClientBackup, ServerErrorIsReportedAndTheOldFileKept) {
    std::ofstream(file()) << "older backup";
    server_.admin.backup.pop_back();
    server_.admin.backupStatus = grpc::Status(grpc::StatusCode::DATA_LOSS, "page 7 is damaged");
    const auto report = server_.client().backupToFile(file());
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kDataLoss);
    EXPECT_EQ(written(), "older backup");
}

TEST_F(ClientBackup, FullDiskIsReported) {
    const auto report = server_.client().backupToFile(folder_ + "/no/such/folder/copy.db");
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kFileNotWritable);
}

TEST_F(ClientBackup, RestoreSendsSizeChunksAndChecksum) {
    const std::string large(3'000'000, 'x');
    std::ofstream(file(), std::ios::binary) << large;
    const auto report = server_.client().restoreFromFile(file());
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->shapes, 3u);
    const auto& chunks = server_.admin.restored;
    ASSERT_EQ(chunks.size(), 3u);
    EXPECT_EQ(chunks.front().total_bytes(), large.size());
    EXPECT_EQ(chunks.back().sha256(), digestOf(large));
    std::string joined;
    for (const v1::BackupChunk& chunk : chunks) {
        EXPECT_LE(chunk.data().size(), std::size_t{1} << 20);
        joined += chunk.data();
    }
    EXPECT_EQ(joined, large);
}

TEST_F(ClientBackup, RestoreRefusesMissingAndEmptyFiles) {
    EXPECT_EQ(server_.client().restoreFromFile(file()).error().code, ErrorCode::kFileNotReadable);
    EXPECT_EQ(server_.client().restoreFromFile(folder_).error().code, ErrorCode::kFileNotReadable);
    std::ofstream(file()).close();
    EXPECT_EQ(server_.client().restoreFromFile(file()).error().code, ErrorCode::kFileNotReadable);
}

TEST_F(ClientBackup, ExportsAndImportsOneCollection) {
    const auto exported = server_.client().exportCollection("parts", file());
    ASSERT_TRUE(exported) << exported.error().message;
    EXPECT_EQ(server_.admin.exported, "parts");
    EXPECT_EQ(exported->sha256, digestOf(content_));
    EXPECT_EQ(written(), content_);

    std::string stage;
    RunContext context;
    context.progress = [&](const char* name, std::uint64_t, std::uint64_t) { stage = name; };
    const auto imported = server_.client().importCollection(file(), "copy", context);
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(imported->collection, "parts");
    EXPECT_EQ(imported->shapes, 7u);
    EXPECT_EQ(imported->shapesPending, 2u);
    EXPECT_EQ(stage, "import");
    const auto& messages = server_.admin.imported;
    ASSERT_EQ(messages.size(), 2u);
    EXPECT_EQ(messages[0].header().collection(), "copy");
    EXPECT_EQ(messages[1].chunk().total_bytes(), content_.size());
    EXPECT_EQ(messages[1].chunk().data(), content_);
    EXPECT_EQ(messages[1].chunk().sha256(), digestOf(content_));
    EXPECT_EQ(server_.client().importCollection(folder_).error().code, ErrorCode::kFileNotReadable);
}

/// The chunks that a server sends of an increment.
void offer(FakeAdmin& admin, const std::string& increment) {
    admin.backup.assign(2, v1::BackupChunk());
    admin.backup[0].set_total_bytes(increment.size());
    admin.backup[0].set_data(increment);
    admin.backup[1].set_sha256(digestOf(increment));
}

TEST_F(ClientBackup, AnIncrementIsAskedForByTheManifest) {
    const std::string before = testing::database(5, 1);
    const std::string after = testing::database(6, 2);
    const std::string full = testing::writeBytes(folder_ + "/full", before);
    const std::string increment = testing::incrementBetween(before, after);
    offer(server_.admin, increment);
    const auto report = server_.client().incrementToFile(file(), full);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(written(), increment);
    EXPECT_EQ(report->bytes, increment.size());
    EXPECT_EQ(report->changedBytes, after.size());
    EXPECT_EQ(report->backup.bytes, after.size());
    EXPECT_EQ(report->backup.sha256, digestOf(after));
    const v1::BackupManifest& asked = server_.admin.backupRequest.since();
    const BackupManifest manifest = testing::manifestOf(before, kBackupPageBytes);
    EXPECT_EQ(asked.bytes(), before.size());
    EXPECT_EQ(asked.sha256(), digestOf(before));
    EXPECT_EQ(asked.block_bytes(), kBackupPageBytes);
    ASSERT_EQ(asked.block_hashes().size(), manifest.blocks.size() * 32);
    EXPECT_EQ(asked.block_hashes().compare(32, 32, digestOf(before.substr(4'096, 4'096))), 0);

    // The next one follows from the increment alone.
    const std::string later = testing::database(6, 3);
    offer(server_.admin, testing::incrementBetween(after, later));
    ASSERT_TRUE(server_.client().incrementToFile(folder_ + "/next", file()));
    EXPECT_EQ(server_.admin.backupRequest.since().sha256(), digestOf(after));
    const auto restored = server_.client().restoreFromFiles({full, file(), folder_ + "/next"});
    ASSERT_TRUE(restored) << restored.error().message;
    ASSERT_EQ(server_.admin.restored.size(), 1u);
    EXPECT_EQ(server_.admin.restored[0].data(), later);
    EXPECT_EQ(server_.admin.restored[0].sha256(), digestOf(later));
}

TEST_F(ClientBackup, WhatIsNotTheIncrementAskedForIsNotKept) {
    const std::string before = testing::database(5, 1);
    const std::string full = testing::writeBytes(folder_ + "/full", before);
    const auto refused = [&](ErrorCode code, const std::string& words) {
        const auto report = server_.client().incrementToFile(file(), full);
        ASSERT_FALSE(report) << words;
        EXPECT_EQ(report.error().code, code) << report.error().message;
        EXPECT_NE(report.error().message.find(words), std::string::npos) << report.error().message;
        EXPECT_FALSE(fs::exists(file()));
        EXPECT_FALSE(fs::exists(file() + ".part"));
    };
    refused(ErrorCode::kRejected, "does not know increments");  // an older server sends everything
    const std::string good = testing::incrementBetween(before, testing::database(5, 2));
    offer(server_.admin, testing::incrementBetween(testing::database(5, 3), before));
    refused(ErrorCode::kInternal, "to another backup");
    std::string damaged = good;
    damaged[200] ^= 1;
    offer(server_.admin, damaged);
    refused(ErrorCode::kMalformedFile, "checksum");
    offer(server_.admin, good);
    server_.admin.backup[1].set_sha256(digestOf("other"));
    refused(ErrorCode::kChecksumMismatch, "damaged in transfer");
    offer(server_.admin, good);
    server_.admin.backup.pop_back();
    refused(ErrorCode::kCountMismatch, "ended after");
    server_.admin.backup.clear();
    refused(ErrorCode::kCountMismatch, "ended after");
}

TEST_F(ClientBackup, ADamagedExportLeavesNoFile) {
    server_.admin.backup.back().set_data(content_.substr(4, 9) + "something");
    EXPECT_FALSE(server_.client().exportCollection("parts", file()));
    EXPECT_TRUE(nothingLeft());
}

}  // namespace
}  // namespace shapedb::client
