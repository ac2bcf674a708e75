// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/backup_stream.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <unistd.h>

#include "common/backup_increment.h"
#include "common/sha256.h"
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

TEST_F(BackupStream, AnIncrementHoldsWhatHasChanged) {
    const auto manifestOf = [](const std::string& content, std::uint64_t blockBytes) {
        ManifestMaker maker(blockBytes);
        maker.add(content.data(), content.size());
        return maker.finish();
    };
    const std::string base = noise(700 * 4'096);
    std::string now = base + noise(4'096);
    for (const std::size_t page : {1, 300, 301}) now[page * 4'096 + 17] ^= 1;
    std::ofstream(directory + "/now", std::ios::binary) << now;
    for (const std::uint64_t blockBytes : {4'096u, 8'192u, 4u << 20}) {
        std::string sent;
        std::vector<v1::BackupChunk> chunks;
        const auto result = sendIncrement(directory + "/now", manifestOf(base, blockBytes), {},
                                          [&](const v1::BackupChunk& chunk) {
                                              EXPECT_LE(chunk.data().size(), std::size_t{1} << 20);
                                              sent += chunk.data();
                                              chunks.push_back(chunk);
                                              return Result<void>();
                                          });
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(chunks.front().total_bytes(), sent.size());
        const Sha256Digest digest = sha256(sent.data(), sent.size());
        EXPECT_EQ(chunks.back().sha256(), std::string(digest.begin(), digest.end()));

        const auto headBytes = incrementHeadBytes(sent, sent.size());
        ASSERT_TRUE(headBytes) << headBytes.error().message;
        const auto head = decodeIncrementHead(sent.substr(0, *headBytes), sent.size());
        ASSERT_TRUE(head) << head.error().message;
        EXPECT_TRUE(head->base == manifestOf(base, blockBytes).backup);
        EXPECT_TRUE(head->result.backup == manifestOf(now, blockBytes).backup);
        EXPECT_EQ(head->result.blocks, manifestOf(now, blockBytes).blocks);
        const std::vector<std::uint32_t> changed =
            blockBytes == 4'096u   ? std::vector<std::uint32_t>{1, 300, 301, 700}
            : blockBytes == 8'192u ? std::vector<std::uint32_t>{0, 150, 350}
                                   : std::vector<std::uint32_t>{0};
        EXPECT_EQ(head->changed, changed);
        std::string blocks;
        for (const std::uint32_t block : changed) {
            blocks += now.substr(static_cast<std::size_t>(block * blockBytes),
                                 static_cast<std::size_t>(blockBytes));
        }
        EXPECT_EQ(sent.substr(*headBytes), blocks);
    }
}

TEST_F(BackupStream, ManifestsThatCannotBeAreRefused) {
    v1::BackupManifest good;
    good.set_bytes(3 * 4'096);
    good.set_sha256(std::string(32, 's'));
    good.set_block_bytes(4'096);
    good.set_block_hashes(std::string(64, 'a') + std::string(32, 'b'));
    const auto checked = checkedManifest(good);
    ASSERT_TRUE(checked) << checked.error().message;
    EXPECT_EQ(checked->blocks.size(), 3u);
    EXPECT_EQ(checked->blocks[2][0], 'b');
    const auto refused = [&](const std::function<void(v1::BackupManifest&)>& change,
                             const std::string& words) {
        v1::BackupManifest bad = good;
        change(bad);
        const auto result = checkedManifest(bad);
        ASSERT_FALSE(result) << words;
        EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
        EXPECT_EQ(result.error().message.rfind("since: ", 0), 0u) << result.error().message;
        EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
    };
    refused([](auto& bad) { bad.Clear(); }, "blocks of 0 bytes");
    refused([](auto& bad) { bad.set_block_bytes(5'000); }, "power of two");
    refused([](auto& bad) { bad.set_block_bytes(std::uint64_t{1} << 63); }, "power of two");
    refused([](auto& bad) { bad.set_bytes(0); }, "whole number of pages");
    refused([](auto& bad) { bad.set_bytes(3 * 4'096 + 1); }, "whole number of pages");
    refused([](auto& bad) { bad.set_bytes(~std::uint64_t{4'095}); }, "more than 65536 blocks");
    refused([](auto& bad) { bad.set_bytes(4 * 4'096); }, "must be 128 for 4 blocks");
    refused([](auto& bad) { bad.mutable_block_hashes()->pop_back(); }, "block_hashes has 95 bytes");
    refused([](auto& bad) { bad.set_sha256("short"); }, "sha256 has 5 bytes");
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
