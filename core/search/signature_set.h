// The cached signatures of one collection: an immutable snapshot that queries read while
// the next one is prepared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/signature/signature.h"

namespace shapedb {

struct IndexEntry {
    std::int64_t id = 0;  ///< > 0, unique in the set; breaks ties
    std::string key;
    std::map<std::string, std::string> metadata;
    Signature signature;
};

/// A persistent set ordered by id. Copies share all blocks; an update copies only the blocks
/// it touches, so that publishing one ingested shape costs the same in a set of ten and of a
/// million.
///
/// Thread-safety: const members from any thread; a set is never modified once shared.
class SignatureSet {
  public:
    using EntryPtr = std::shared_ptr<const IndexEntry>;

    SignatureSet() = default;

    /// This set with the entries of `updates` inserted or replaced (by id) and those of
    /// `removedIds` left out (unknown ids are ignored). Neither needs an order; an id must
    /// not be in both, nor twice in `updates`. No entry may be null.
    [[nodiscard]] SignatureSet with(std::vector<EntryPtr> updates,
                                    std::vector<std::int64_t> removedIds) const;

    [[nodiscard]] std::size_t size() const { return size_; }
    /// Null when absent.
    [[nodiscard]] EntryPtr find(std::int64_t id) const;
    /// Bytes held by the entries, about.
    [[nodiscard]] std::size_t memoryBytes() const;

    /// Entries in blocks of 1 to kBlockSize by rising id; for scans.
    using Block = std::vector<EntryPtr>;
    static constexpr std::size_t kBlockSize = 1024;
    [[nodiscard]] const std::vector<std::shared_ptr<const Block>>& blocks() const { return blocks_; }

  private:
    std::vector<std::shared_ptr<const Block>> blocks_;
    std::size_t size_ = 0;
};

}  // namespace shapedb
