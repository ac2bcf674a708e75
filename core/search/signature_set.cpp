// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/signature_set.h"

#include <algorithm>
#include <utility>

namespace shapedb {

namespace {

using BlockPtr = std::shared_ptr<const SignatureBlock>;
using Updates = std::vector<const IndexEntry*>;

bool idLess(const IndexEntry* a, const IndexEntry* b) { return a->id < b->id; }

// A row of the next set: from an old block, or new.
struct Source {
    const SignatureBlock* block = nullptr;
    std::size_t row = 0;
    const IndexEntry* entry = nullptr;
};

// The rows of a block after the changes in its range of ids.
std::vector<Source> applyChanges(const SignatureBlock& block, Updates::const_iterator updatesBegin,
                                 Updates::const_iterator updatesEnd,
                                 const std::vector<std::int64_t>& removed) {
    std::vector<Source> merged;
    merged.reserve(block.size() + static_cast<std::size_t>(updatesEnd - updatesBegin));
    auto update = updatesBegin;
    for (std::size_t row = 0; row < block.size(); ++row) {
        const std::int64_t id = block.id(row);
        for (; update != updatesEnd && (*update)->id < id; ++update) merged.push_back({nullptr, 0, *update});
        if (update != updatesEnd && (*update)->id == id) {
            merged.push_back({nullptr, 0, *update++});
        } else if (!std::binary_search(removed.begin(), removed.end(), id)) {
            merged.push_back({&block, row, nullptr});
        }
    }
    for (; update != updatesEnd; ++update) merged.push_back({nullptr, 0, *update});
    return merged;
}

BlockPtr blockOf(std::vector<Source>::const_iterator begin, std::vector<Source>::const_iterator end) {
    auto block = std::make_shared<SignatureBlock>();
    block->reserve(static_cast<std::size_t>(end - begin));
    for (auto source = begin; source != end; ++source) {
        if (source->entry != nullptr) {
            block->append(*source->entry);
        } else {
            block->append(*source->block, source->row);
        }
    }
    block->shrink();
    return block;
}

}  // namespace

SignatureSet SignatureSet::ofBlocks(const std::vector<BlockPtr>& blocks) {
    SignatureSet set;
    for (const BlockPtr& block : blocks) {
        if (block->size() == 0) continue;
        set.size_ += block->size();
        set.blocks_.push_back(block);
    }
    return set;
}

SignatureSet SignatureSet::ofParts(const std::vector<SignatureSet>& parts) {
    SignatureSet set;
    for (const SignatureSet& part : parts) {
        if (part.size() == 0) continue;
        set.size_ += part.size();
        set.blocks_.insert(set.blocks_.end(), part.blocks_.begin(), part.blocks_.end());
        set.partEnds_.push_back(set.blocks_.size());
    }
    return set;
}

SignatureSet SignatureSet::with(const std::vector<IndexEntry>& updates,
                                std::vector<std::int64_t> removedIds) const {
    Updates sorted;
    sorted.reserve(updates.size());
    for (const IndexEntry& entry : updates) sorted.push_back(&entry);
    std::sort(sorted.begin(), sorted.end(), idLess);
    std::sort(removedIds.begin(), removedIds.end());
    SignatureSet next;
    auto update = sorted.cbegin();
    const auto keep = [&next](BlockPtr block) {
        next.size_ += block->size();
        next.blocks_.push_back(std::move(block));
    };
    // Splits too many rows for a block evenly: cutting off only the excess would leave a block of one entry
    // for each id that arrives late.
    const auto keepSplit = [&keep](const std::vector<Source>& rows) {
        const std::size_t parts = (rows.size() + kBlockSize - 1) / kBlockSize;
        for (std::size_t part = 0; part < parts; ++part) {
            keep(blockOf(rows.begin() + static_cast<std::ptrdiff_t>(part * rows.size() / parts),
                         rows.begin() + static_cast<std::ptrdiff_t>((part + 1) * rows.size() / parts)));
        }
    };
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
        const SignatureBlock& block = *blocks_[b];
        // The range of a block ends at the next block's first id; that of the last block is open as long as
        // it has room.
        const bool lastAndFull = b + 1 == blocks_.size() && block.size() == kBlockSize;
        auto updatesEnd = sorted.cend();
        if (b + 1 < blocks_.size()) {
            const std::int64_t bound = blocks_[b + 1]->id(0);
            updatesEnd =
                std::find_if(update, sorted.cend(), [&](const IndexEntry* e) { return e->id >= bound; });
        }
        const auto removedFrom = std::lower_bound(removedIds.begin(), removedIds.end(), block.id(0));
        const bool removes = removedFrom != removedIds.end() && *removedFrom <= block.id(block.size() - 1);
        const bool follow = update != updatesEnd && (*update)->id > block.id(block.size() - 1);
        // Ids rise as shapes are added, so this is the usual case: the full block is shared and a new one
        // begun.
        if (lastAndFull && follow && !removes) {
            keep(blocks_[b]);
            keepSplit(applyChanges({}, update, updatesEnd, {}));
        } else if (update == updatesEnd && !removes) {
            keep(blocks_[b]);
        } else {
            keepSplit(applyChanges(block, update, updatesEnd, removedIds));
        }
        update = updatesEnd;
    }
    if (blocks_.empty()) keepSplit(applyChanges({}, update, sorted.cend(), {}));
    return next;
}

std::size_t SignatureSet::attributedCount() const {
    std::size_t count = 0;
    for (const BlockPtr& block : blocks_) count += block->attributedCount();
    return count;
}

SignatureSet::Place SignatureSet::find(std::int64_t id) const {
    if (partEnds_.empty()) return findIn(blocks_.begin(), blocks_.end(), id);
    auto begin = blocks_.begin();
    for (const std::size_t partEnd : partEnds_) {
        const auto end = blocks_.begin() + static_cast<std::ptrdiff_t>(partEnd);
        if (const Place place = findIn(begin, end, id)) return place;
        begin = end;
    }
    return {};
}

SignatureSet::Place SignatureSet::findIn(Blocks::const_iterator begin, Blocks::const_iterator end,
                                         std::int64_t id) {
    auto block = std::upper_bound(begin, end, id,
                                  [](std::int64_t wanted, const BlockPtr& b) { return wanted < b->id(0); });
    if (block == begin) return {};
    --block;
    std::size_t low = 0;
    std::size_t high = (*block)->size();
    while (low < high) {
        const std::size_t middle = (low + high) / 2;
        if ((*block)->id(middle) < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if (low == (*block)->size() || (*block)->id(low) != id) return {};
    return {block->get(), low};
}

std::size_t SignatureSet::memoryBytes() const {
    std::size_t bytes = blocks_.capacity() * sizeof(BlockPtr);
    for (const BlockPtr& block : blocks_) bytes += block->memoryBytes();
    return bytes;
}

}  // namespace shapedb
