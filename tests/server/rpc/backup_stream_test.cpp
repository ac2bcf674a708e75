#include "server/rpc/backup_stream.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/random.h"
#include "server/files/data_directory.h"
#include "server/files/temporary_file.h"

namespace shapedb::rpc {
namespace {

class BackupStream : public ::testing::Test {
  protected:
    BackupStream() : directory(::testing::TempDir() + "shapedb-backup-" + std::to_string(::getpid())) {
        EXPECT_TRUE(files::prepareTemporaryDirectory(directory));
    }
    ~BackupStream() override { std::filesystem::remove_all(directory); }

    static std::string noise(std::size_t size) {
        Random random(size);
        std::string text(size, '\0');
        for (char& c : text) c = static_cast<char>(random.next());
        return text;
    }

    std::vector<v1::BackupChunk> chunksOf(const std::string& content) {
        std::ofstream(directory + "/in", std::ios::binary) << content;
        std::vector<v1::BackupChunk> chunks;
        const auto sent = sendFile(directory + "/in", {}, [&](const v1::BackupChunk& chunk) {
            chunks.push_back(chunk);
            return Result<void>();
        });
        EXPECT_TRUE(sent) << sent.error().message;
        return chunks;
    }

    static std::string contentOf(const std::string& path) {
        std::ifstream stream(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }

    std::string directory;
};

TEST_F(BackupStream, ReceivesWhatWasSent) {
    for (const std::size_t size :
         {std::size_t{1}, std::size_t{1} << 20, (std::size_t{1} << 20) + 1, std::size_t{3'500'000}}) {
        const std::string content = noise(size);
        const auto chunks = chunksOf(content);
        EXPECT_EQ(chunks.front().total_bytes(), size);
        EXPECT_EQ(chunks.back().sha256().size(), 32u);
        const auto file = files::TemporaryFile::create(directory);
        ASSERT_TRUE(file);
        auto receiver = FileReceiver::create(file->path());
        ASSERT_TRUE(receiver);
        for (const auto& chunk : chunks) {
            EXPECT_LE(chunk.data().size(), std::size_t{1} << 20);
            const auto added = receiver->add(chunk);
            ASSERT_TRUE(added) << added.error().message;
        }
        ASSERT_TRUE(receiver->finish());
        EXPECT_EQ(receiver->bytes(), size);
        EXPECT_EQ(contentOf(file->path()), content);
    }
}

TEST_F(BackupStream, ChecksumMayComeWithTheLastData) {
    const auto chunks = chunksOf(noise(100));
    v1::BackupChunk one = chunks[0];
    one.set_sha256(chunks[1].sha256());
    const auto file = files::TemporaryFile::create(directory);
    auto receiver = FileReceiver::create(file->path());
    ASSERT_TRUE(receiver->add(one));
    EXPECT_TRUE(receiver->finish());
}

TEST_F(BackupStream, StopsSendingWhenTheReceiverHasGone) {
    std::ofstream(directory + "/in", std::ios::binary) << noise(5'000'000);
    int sent = 0;
    const auto result = sendFile(directory + "/in", {}, [&](const v1::BackupChunk&) -> Result<void> {
        if (++sent < 2) return {};
        return fail(ErrorCode::kCancelled, "gone");
    });
    EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
    EXPECT_EQ(sent, 2);
    EXPECT_EQ(sendFile(directory + "/none", {}, [](const auto&) { return Result<void>(); }).error().code,
              ErrorCode::kFileNotReadable);
}

TEST_F(BackupStream, DoesNotOverwriteAFile) {
    std::ofstream(directory + "/there") << "precious";
    EXPECT_FALSE(FileReceiver::create(directory + "/there"));
    EXPECT_EQ(contentOf(directory + "/there"), "precious");
}

}  // namespace
}  // namespace shapedb::rpc
