// SPDX-License-Identifier: Apache-2.0
// Reads increments, which may be damaged or no increments at all. Private to client/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/backup/backup_file.h"
#include "common/backup_increment.h"
#include "core/base/error.h"

namespace shapedb::client {

/// Errors, which name the file: kMalformedFile (not an increment, or damaged; its blocks are not read),
/// kFileNotReadable.
[[nodiscard]] Result<IncrementHead> readIncrementHead(const SourceFile& file);

/// The blocks that an increment brings, one after the other. Keeps their hashes, no block. Not thread-safe.
class IncrementBlocks {
  public:
    /// `head` is that of the file.
    IncrementBlocks(SourceFile file, const IncrementHead& head);

    /// Leaves out blocks that end at or before this byte of the result.
    void skipTo(std::uint64_t position);
    /// Where the next block is in the result; beyond every position if none is left.
    [[nodiscard]] std::uint64_t begin() const;
    [[nodiscard]] std::uint64_t end() const;
    /// The next whole pages of the next block, which it must have. Errors: kFileNotReadable; kMalformedFile,
    /// with the last page of a block that has not the hash it should.
    [[nodiscard]] Result<void> read(char* to, std::size_t size);

  private:
    struct Block {
        std::uint32_t index;
        Sha256Digest hash;
    };

    SourceFile file_;
    std::uint64_t resultBytes_;
    std::uint64_t blockBytes_;
    std::vector<Block> blocks_;
    std::size_t next_ = 0;
    std::uint64_t at_;        ///< of the next block in the file
    std::uint64_t read_ = 0;  ///< of the next block
    BlockHash hash_;
};

}  // namespace shapedb::client
