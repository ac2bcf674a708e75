// SPDX-License-Identifier: Apache-2.0
// A full backup and the increments made after it, read as the backup that they lead to. Private to client/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/backup/backup_file.h"
#include "client/backup/increment_file.h"
#include "common/backup_manifest.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::client {

/// The manifest of a backup: of a full one it is computed, an increment has that of the backup it leads to.
/// Reports the stage "read" in bytes. Errors: kFileNotReadable, kMalformedFile (neither of both, or damaged),
/// kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<BackupManifest> readManifest(const std::string& path, const RunContext& context);

/// Reads front to back and keeps no more than the hashes of the blocks that the increments bring. Not
/// thread-safe.
class BackupChain {
  public:
    /// `files`: a full backup, which is not looked into if it is alone, and each increment after the one it
    /// continues. Reads the full backup to be sure of it; reports as readManifest. Errors: those of
    /// readManifest; kInvalidArgument (an increment does not continue the file before it, or no file at all),
    /// kChecksumMismatch (the full backup is another one or damaged).
    [[nodiscard]] static Result<BackupChain> open(const std::vector<std::string>& files,
                                                  const RunContext& context);

    /// The size of the backup that the chain leads to.
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

    /// The next bytes, as many as `most`, whole pages, unless the end comes before; 0 at the end. The last
    /// ones come only if all had the right checksum. Errors: kFileNotReadable, kMalformedFile (a block of an
    /// increment is damaged), kChecksumMismatch (a file has changed since it was opened).
    [[nodiscard]] Result<std::size_t> read(char* to, std::size_t most);

  private:
    explicit BackupChain(SourceFile full) : full_(std::move(full)), bytes_(full_.bytes()) {}
    Result<void> readPiece(char* to, std::size_t size, IncrementBlocks* source);

    SourceFile full_;
    std::vector<IncrementBlocks> increments_;  ///< in the order they were made
    std::uint64_t bytes_;
    Sha256Digest wanted_{};  ///< meaningless without increments
    Sha256 whole_;
    std::uint64_t position_ = 0;
};

}  // namespace shapedb::client
