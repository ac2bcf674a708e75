// SPDX-License-Identifier: GPL-3.0-or-later
// The cached signatures of one collection: an immutable snapshot that queries read while the next one is
// prepared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/search/signature_block.h"

namespace shapedb {

/// A persistent set ordered by id. Copies share all blocks, and an update copies only the blocks it
/// touches, so that publishing one shape costs the same in a set of ten and of a million.
///
/// Thread-safe: all members are const; a set is never modified once shared.
class SignatureSet {
  public:
    SignatureSet() = default;

    /// From blocks with rising ids, each block's above those of the block before. Empty blocks are left
    /// out.
    [[nodiscard]] static SignatureSet ofBlocks(
        const std::vector<std::shared_ptr<const SignatureBlock>>& blocks);

    /// All entries of sets that have no id in common, as a set to be searched: it shares their blocks, and
    /// `with` must not be called. Its blocks are in ascending order of id within each part alone.
    [[nodiscard]] static SignatureSet ofParts(const std::vector<SignatureSet>& parts);

    /// This set with the entries of `updates` inserted or replaced (by id) and without those of
    /// `removedIds` (unknown ids are ignored). In any order; an id must not be in both, nor twice in
    /// `updates`.
    [[nodiscard]] SignatureSet with(const std::vector<IndexEntry>& updates,
                                    std::vector<std::int64_t> removedIds) const;

    [[nodiscard]] std::size_t size() const { return size_; }
    /// How many have attributes.
    [[nodiscard]] std::size_t attributedCount() const;

    /// Where a signature is; valid while the set or a copy of it lives.
    struct Place {
        const SignatureBlock* block = nullptr;  ///< null: not in the set
        std::size_t row = 0;
        explicit operator bool() const { return block != nullptr; }
    };
    [[nodiscard]] Place find(std::int64_t id) const;

    /// Approximate bytes held.
    [[nodiscard]] std::size_t memoryBytes() const;

    /// Blocks of 1 to kBlockSize entries in ascending order of id (see ofParts).
    static constexpr std::size_t kBlockSize = SignatureBlock::kMostRows;
    [[nodiscard]] const std::vector<std::shared_ptr<const SignatureBlock>>& blocks() const { return blocks_; }

  private:
    using Blocks = std::vector<std::shared_ptr<const SignatureBlock>>;
    static Place findIn(Blocks::const_iterator begin, Blocks::const_iterator end, std::int64_t id);

    Blocks blocks_;
    std::vector<std::size_t> partEnds_;  ///< in blocks_; empty: there is one part
    std::size_t size_ = 0;
};

}  // namespace shapedb
