// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/backup_manifest.h"

#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

std::string pagesOfNoise(std::uint64_t pages, std::uint64_t seed) {
    Random random(seed);
    std::string text(static_cast<std::size_t>(pages * kBackupPageBytes), '\0');
    for (char& c : text) c = static_cast<char>(random.next());
    return text;
}

/// The same however the file is cut into pieces.
BackupManifest manifestOf(const std::string& file, std::uint64_t blockBytes, std::size_t pagesAtOnce = 3) {
    ManifestMaker maker(blockBytes);
    const std::size_t piece = pagesAtOnce * kBackupPageBytes;
    for (std::size_t at = 0; at < file.size(); at += piece) {
        maker.add(file.data() + at, std::min(piece, file.size() - at));
    }
    return maker.finish();
}

TEST(BackupManifest, BlocksAreAsSmallAsTheirNumberAllows) {
    const std::uint64_t smallest = kMaxBackupBlocks * kBackupPageBytes;
    EXPECT_EQ(backupBlockBytes(kBackupPageBytes), kBackupPageBytes);
    EXPECT_EQ(backupBlockBytes(smallest), kBackupPageBytes);
    EXPECT_EQ(backupBlockBytes(smallest + kBackupPageBytes), 2 * kBackupPageBytes);
    EXPECT_EQ(backupBlockBytes(kMaxBackupBlocks * kMaxBackupBlockBytes), kMaxBackupBlockBytes);
    for (std::uint64_t bytes = kBackupPageBytes; bytes < std::uint64_t{1} << 44; bytes = 3 * bytes) {
        EXPECT_TRUE(checkBlocks(bytes, backupBlockBytes(bytes))) << bytes;
    }
}

TEST(BackupManifest, SizesThatCannotBeAreRefused) {
    EXPECT_FALSE(checkBlocks(0, 4'096));
    EXPECT_FALSE(checkBlocks(4'095, 4'096));
    EXPECT_FALSE(checkBlocks(8'192, 0));
    EXPECT_FALSE(checkBlocks(8'192, 2'048));
    EXPECT_FALSE(checkBlocks(8'192, 12'288));
    EXPECT_FALSE(checkBlocks(8'192, 2 * kMaxBackupBlockBytes));
    EXPECT_FALSE(checkBlocks((kMaxBackupBlocks + 1) * 4'096, 4'096));
    EXPECT_FALSE(checkBlocks(~std::uint64_t{4'095}, kMaxBackupBlockBytes));
    EXPECT_TRUE(checkBlocks(8'192, kMaxBackupBlockBytes));
}

TEST(BackupManifest, TheLastBlockMayBeShorter) {
    EXPECT_EQ(countBlocks(5 * 4'096, 8'192), 3u);
    EXPECT_EQ(bytesOfBlock(5 * 4'096, 8'192, 1), 8'192u);
    EXPECT_EQ(bytesOfBlock(5 * 4'096, 8'192, 2), 4'096u);
    EXPECT_EQ(bytesOfBlock(5 * 4'096, 8'192, 3), 0u);
}

// Literal values: the hashes are kept in files.
TEST(BackupManifest, HashesAreTreesOfPages) {
    const std::string file = pagesOfNoise(3, 1);
    const BackupManifest pages = manifestOf(file, 4'096);
    ASSERT_EQ(pages.blocks.size(), 3u);
    EXPECT_EQ(pages.backup.bytes, 3u * 4'096);
    EXPECT_EQ(pages.backup.sha256, sha256(file.data(), file.size()));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(pages.blocks[i], sha256(file.data() + i * 4'096, 4'096));

    const std::string pair(pages.blocks[0].begin(), pages.blocks[0].end());
    const std::string both = pair + std::string(pages.blocks[1].begin(), pages.blocks[1].end());
    const Sha256Digest first = sha256(both.data(), both.size());
    const BackupManifest pairs = manifestOf(file, 8'192);
    EXPECT_EQ(pairs.blocks, (std::vector<Sha256Digest>{first, pages.blocks[2]}));
    std::string all(first.begin(), first.end());
    all.append(pages.blocks[2].begin(), pages.blocks[2].end());
    EXPECT_EQ(manifestOf(file, 16'384).blocks, std::vector<Sha256Digest>{sha256(all.data(), all.size())});

    const std::string zeros(2 * 4'096, '\0');
    EXPECT_EQ(toHex(manifestOf(zeros, 8'192).blocks[0]),
              "90cefbd5d8858e0ddfb9bd65d7a4920c83019fbe5149e2ee4c2ba34943a1efce");
}

TEST(BackupManifest, CoarserBlocksFollowFromFinerOnes) {
    for (std::uint64_t pages = 1; pages < 40; ++pages) {
        const std::string file = pagesOfNoise(pages, pages);
        const BackupManifest fine = manifestOf(file, 4'096, 1 + pages % 7);
        for (std::uint64_t blockBytes = 4'096; blockBytes <= 64 * 4'096; blockBytes *= 2) {
            const BackupManifest coarse = coarsened(fine, blockBytes);
            EXPECT_EQ(coarse.blockBytes, blockBytes);
            EXPECT_EQ(coarse.blocks, manifestOf(file, blockBytes).blocks)
                << pages << " pages, " << blockBytes;
            EXPECT_EQ(coarse.blocks.size(), countBlocks(file.size(), blockBytes));
        }
    }
}

TEST(BackupManifest, ChangedBlocksAreFound) {
    std::string file = pagesOfNoise(9, 5);
    const BackupManifest base = manifestOf(file, 8'192);
    EXPECT_TRUE(changedBlocks(base, base).empty());
    file[3 * 4'096] ^= 1;
    EXPECT_EQ(changedBlocks(base, manifestOf(file, 8'192)), std::vector<std::uint32_t>{1});
    file += pagesOfNoise(2, 6);
    EXPECT_EQ(changedBlocks(base, manifestOf(file, 8'192)), (std::vector<std::uint32_t>{1, 4, 5}));
    file.resize(5 * 4'096);
    EXPECT_EQ(changedBlocks(base, manifestOf(file, 8'192)), (std::vector<std::uint32_t>{1, 2}));
}

}  // namespace
}  // namespace shapedb
