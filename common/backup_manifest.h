// SPDX-License-Identifier: Apache-2.0
// A backup by the hashes of its blocks: enough to find what has changed since, without the backup itself.
//
// The hash of a page is its SHA-256. The pages of a block are hashed in pairs, their hashes in pairs again,
// and so on to one: SHA-256 of the one hash followed by the other, and the last of an odd number goes up as
// it is. So the hashes of blocks of twice the size follow from those of smaller ones, and a chain of
// increments goes on when the database has outgrown its blocks. Persisted and sent (docs/backup-format.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/sha256.h"
#include "core/base/error.h"

namespace shapedb {

/// A backup is a whole number of pages.
constexpr std::uint64_t kBackupPageBytes = 4'096;
/// Their hashes, 2 MiB, fit a message of 4 MiB.
constexpr std::uint64_t kMaxBackupBlocks = 65'536;
/// With the number above the most that a database with such pages can have, 16 TiB.
constexpr std::uint64_t kMaxBackupBlockBytes = std::uint64_t{256} << 20;

/// Which backup: no two have the same.
struct BackupId {
    std::uint64_t bytes = 0;
    Sha256Digest sha256{};  ///< of the whole file
};
[[nodiscard]] inline bool operator==(const BackupId& a, const BackupId& b) {
    return a.bytes == b.bytes && a.sha256 == b.sha256;
}

struct BackupManifest {
    BackupId backup;
    std::uint64_t blockBytes = kBackupPageBytes;  ///< a power of two from the page to the largest block
    std::vector<Sha256Digest> blocks;             ///< in the order of the file; the last may be shorter
};

/// The smallest blocks that a file of this many bytes may have; the largest ones for a file that has too
/// many.
[[nodiscard]] std::uint64_t backupBlockBytes(std::uint64_t bytes);
/// How many blocks such a file has. `blockBytes` must not be 0.
[[nodiscard]] std::uint64_t countBlocks(std::uint64_t bytes, std::uint64_t blockBytes);
/// How many bytes of such a file are in this block; 0 beyond its end.
[[nodiscard]] std::uint64_t bytesOfBlock(std::uint64_t bytes, std::uint64_t blockBytes, std::uint64_t block);

/// Whether a file can be cut so. Errors: kInvalidArgument (no or part of a page, more blocks than allowed,
/// `blockBytes` out of range).
[[nodiscard]] Result<void> checkBlocks(std::uint64_t bytes, std::uint64_t blockBytes);

/// The hash of one block after the other. Not thread-safe. Throws only std::bad_alloc.
class BlockHash {
  public:
    /// Takes the next whole pages of the block.
    void update(const char* data, std::size_t size);
    /// The hash of all pages since the last `finish`; there must be at least one.
    [[nodiscard]] Sha256Digest finish();

  private:
    std::vector<Sha256Digest> pages_;
};

/// The manifest of a file that is read from its beginning to its end. Not thread-safe. Throws only
/// std::bad_alloc.
class ManifestMaker {
  public:
    /// `blockBytes` as checkBlocks allows it.
    explicit ManifestMaker(std::uint64_t blockBytes) { manifest_.blockBytes = blockBytes; }
    /// Takes the next whole pages of the file.
    void add(const char* data, std::size_t size);
    [[nodiscard]] BackupManifest finish();

  private:
    BackupManifest manifest_;
    Sha256 whole_;
    BlockHash block_;
};

/// The same backup in blocks of this size, no smaller than its own and a power of two.
[[nodiscard]] BackupManifest coarsened(BackupManifest manifest, std::uint64_t blockBytes);

/// The blocks of `result` that `base` has not in the same place, ascending. Both have blocks of one size.
[[nodiscard]] std::vector<std::uint32_t> changedBlocks(const BackupManifest& base,
                                                       const BackupManifest& result);

}  // namespace shapedb
