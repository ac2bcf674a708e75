#include "core/search/signature_set.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace shapedb {

namespace {

using EntryPtr = SignatureSet::EntryPtr;
using Block = SignatureSet::Block;

bool idLess(const EntryPtr& a, const EntryPtr& b) { return a->id < b->id; }

// The entries of a block with the changes whose ids fall into its range.
Block applyChanges(const Block& block, std::vector<EntryPtr>::const_iterator updatesBegin,
                   std::vector<EntryPtr>::const_iterator updatesEnd,
                   const std::vector<std::int64_t>& removed) {
    Block merged;
    merged.reserve(block.size() + static_cast<std::size_t>(updatesEnd - updatesBegin));
    auto update = updatesBegin;
    for (const EntryPtr& entry : block) {
        for (; update != updatesEnd && (*update)->id < entry->id; ++update) merged.push_back(*update);
        if (update != updatesEnd && (*update)->id == entry->id) {
            merged.push_back(*update++);
        } else if (!std::binary_search(removed.begin(), removed.end(), entry->id)) {
            merged.push_back(entry);
        }
    }
    merged.insert(merged.end(), update, updatesEnd);
    return merged;
}

}  // namespace

SignatureSet SignatureSet::with(std::vector<EntryPtr> updates, std::vector<std::int64_t> removedIds) const {
    std::sort(updates.begin(), updates.end(), idLess);
    std::sort(removedIds.begin(), removedIds.end());
    SignatureSet next;
    auto update = updates.cbegin();
    const auto keep = [&next](std::shared_ptr<const Block> block) {
        next.size_ += block->size();
        next.blocks_.push_back(std::move(block));
    };
    // Splits what has outgrown a block, evenly: cutting off only the excess would leave a block of
    // one entry for each id that arrives late.
    const auto keepSplit = [&keep](const Block& entries) {
        const std::size_t parts = (entries.size() + kBlockSize - 1) / kBlockSize;
        for (std::size_t part = 0; part < parts; ++part) {
            const std::size_t begin = part * entries.size() / parts;
            const std::size_t end = (part + 1) * entries.size() / parts;
            keep(std::make_shared<const Block>(entries.begin() + static_cast<std::ptrdiff_t>(begin),
                                               entries.begin() + static_cast<std::ptrdiff_t>(end)));
        }
    };
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
        const Block& block = *blocks_[b];
        // A block answers for the ids up to the next block's first.
        auto updatesEnd = updates.cend();
        if (b + 1 < blocks_.size()) {
            updatesEnd = std::lower_bound(update, updates.cend(), blocks_[b + 1]->front(), idLess);
        }
        const auto removedFrom = std::lower_bound(removedIds.begin(), removedIds.end(), block.front()->id);
        const bool removes = removedFrom != removedIds.end() && *removedFrom <= block.back()->id;
        if (update == updatesEnd && !removes) {
            keep(blocks_[b]);
        } else {
            keepSplit(applyChanges(block, update, updatesEnd, removedIds));
        }
        update = updatesEnd;
    }
    keepSplit(Block(update, updates.cend()));
    return next;
}

EntryPtr SignatureSet::find(std::int64_t id) const {
    auto block = std::upper_bound(blocks_.begin(), blocks_.end(), id,
                                  [](std::int64_t wanted, const auto& b) { return wanted < b->front()->id; });
    if (block == blocks_.begin()) return nullptr;
    --block;
    const auto entry =
        std::lower_bound((*block)->begin(), (*block)->end(), id,
                         [](const EntryPtr& e, std::int64_t wanted) { return e->id < wanted; });
    return entry != (*block)->end() && (*entry)->id == id ? *entry : nullptr;
}

std::size_t SignatureSet::memoryBytes() const {
    std::size_t bytes = 0;
    for (const auto& block : blocks_) {
        for (const EntryPtr& entry : *block) {
            bytes += sizeof(EntryPtr) + sizeof(IndexEntry) + entry->key.capacity() +
                     entry->signature.points.capacity() * sizeof(SignaturePoint);
            for (const auto& [key, value] : entry->metadata) bytes += key.capacity() + value.capacity() + 96;
        }
    }
    return bytes;
}

}  // namespace shapedb
