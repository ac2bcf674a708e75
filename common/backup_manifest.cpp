// SPDX-License-Identifier: Apache-2.0
#include "common/backup_manifest.h"

#include <algorithm>
#include <string>
#include <utility>

namespace shapedb {

namespace {

/// One level up: half as many hashes.
void pairUp(std::vector<Sha256Digest>& hashes) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < hashes.size(); i += 2) {
        // Two arrays after one another in a vector have no gap between them.
        hashes[kept++] =
            i + 1 < hashes.size() ? sha256(hashes[i].data(), 2 * sizeof(Sha256Digest)) : hashes[i];
    }
    hashes.resize(kept);
}

}  // namespace

std::uint64_t countBlocks(std::uint64_t bytes, std::uint64_t blockBytes) {
    return bytes / blockBytes + (bytes % blockBytes != 0 ? 1 : 0);
}

std::uint64_t bytesOfBlock(std::uint64_t bytes, std::uint64_t blockBytes, std::uint64_t block) {
    if (block >= countBlocks(bytes, blockBytes)) return 0;
    return std::min(blockBytes, bytes - block * blockBytes);
}

std::uint64_t backupBlockBytes(std::uint64_t bytes) {
    std::uint64_t size = kBackupPageBytes;
    while (size < kMaxBackupBlockBytes && countBlocks(bytes, size) > kMaxBackupBlocks) size *= 2;
    return size;
}

Result<void> checkBlocks(std::uint64_t bytes, std::uint64_t blockBytes) {
    const auto wrong = [](const std::string& what) { return fail(ErrorCode::kInvalidArgument, what); };
    if (blockBytes < kBackupPageBytes || blockBytes > kMaxBackupBlockBytes ||
        (blockBytes & (blockBytes - 1)) != 0) {
        return wrong("blocks of " + std::to_string(blockBytes) + " bytes: must be a power of two from " +
                     std::to_string(kBackupPageBytes) + " to " + std::to_string(kMaxBackupBlockBytes));
    }
    if (bytes == 0 || bytes % kBackupPageBytes != 0) {
        return wrong("a size of " + std::to_string(bytes) +
                     " bytes: a backup is a whole number of pages of " + std::to_string(kBackupPageBytes));
    }
    if (countBlocks(bytes, blockBytes) > kMaxBackupBlocks) {
        return wrong(std::to_string(bytes) + " bytes in blocks of " + std::to_string(blockBytes) +
                     ": more than " + std::to_string(kMaxBackupBlocks) + " blocks");
    }
    return {};
}

void BlockHash::update(const char* data, std::size_t size) {
    for (std::size_t at = 0; at < size; at += kBackupPageBytes) {
        pages_.push_back(sha256(data + at, kBackupPageBytes));
    }
}

Sha256Digest BlockHash::finish() {
    while (pages_.size() > 1) pairUp(pages_);
    const Sha256Digest hash = pages_.front();
    pages_.clear();
    return hash;
}

void ManifestMaker::add(const char* data, std::size_t size) {
    whole_.update(data, size);
    while (size > 0) {
        const std::uint64_t inBlock = manifest_.backup.bytes % manifest_.blockBytes;
        const auto piece =
            static_cast<std::size_t>(std::min<std::uint64_t>(size, manifest_.blockBytes - inBlock));
        block_.update(data, piece);
        manifest_.backup.bytes += piece;
        if (inBlock + piece == manifest_.blockBytes) manifest_.blocks.push_back(block_.finish());
        data += piece;
        size -= piece;
    }
}

BackupManifest ManifestMaker::finish() {
    if (manifest_.backup.bytes % manifest_.blockBytes != 0) manifest_.blocks.push_back(block_.finish());
    manifest_.backup.sha256 = whole_.finish();
    return std::move(manifest_);
}

BackupManifest coarsened(BackupManifest manifest, std::uint64_t blockBytes) {
    for (; manifest.blockBytes < blockBytes; manifest.blockBytes *= 2) pairUp(manifest.blocks);
    return manifest;
}

std::vector<std::uint32_t> changedBlocks(const BackupManifest& base, const BackupManifest& result) {
    std::vector<std::uint32_t> changed;
    for (std::size_t i = 0; i < result.blocks.size(); ++i) {
        if (i >= base.blocks.size() || base.blocks[i] != result.blocks[i]) {
            changed.push_back(static_cast<std::uint32_t>(i));
        }
    }
    return changed;
}

}  // namespace shapedb
