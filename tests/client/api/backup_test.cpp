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

TEST_F(ClientBackup, ADamagedExportLeavesNoFile) {
    server_.admin.backup.back().set_data(content_.substr(4, 9) + "something");
    EXPECT_FALSE(server_.client().exportCollection("parts", file()));
    EXPECT_TRUE(nothingLeft());
}

}  // namespace
}  // namespace shapedb::client
