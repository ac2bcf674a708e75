// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/shard_content.h"

#include <map>
#include <new>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "server/index/entries.h"

namespace shapedb::cluster {

namespace {

/// Rows of one shard that are put into its set together.
constexpr std::size_t kWorthABlock = SignatureSet::kBlockSize / 4;
/// Rows that one thread decodes at a time.
constexpr std::size_t kDecodedTogether = 64;

std::size_t placeOf(std::int64_t shapeId) { return static_cast<std::size_t>(shardOf(shapeId)); }

}  // namespace

std::int64_t ShardContent::Shard::lastId() const {
    if (!waiting.empty()) return waiting.back().id;
    if (set.size() == 0) return 0;
    const SignatureBlock& block = *set.blocks().back();
    return block.id(block.size() - 1);
}

void ShardContent::Shard::settle() {
    if (waiting.empty()) return;
    set = set.with(waiting, {});
    waiting.clear();
}

void ShardContent::begin(std::int64_t generation) {
    generation_ = generation;
    building_ = {};
}

Result<void> ShardContent::put(std::vector<store::IndexRow> rows) {
    try {
        std::vector<IndexEntry> entries(rows.size());
        std::vector<char> good(rows.size());
        RETURN_IF_ERROR(
            parallelFor(rows.size(), kDecodedTogether, {}, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    good[i] = index::toEntry(std::move(rows[i]), entries[i], *log_) ? 1 : 0;
                }
            }));
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (good[i] == 0) continue;
            Shard& shard = building_[placeOf(entries[i].id)];
            const bool follows = entries[i].id > shard.lastId();
            if (!follows) shard.settle();
            shard.waiting.push_back(std::move(entries[i]));
            if (!follows || shard.waiting.size() >= kWorthABlock) shard.settle();
        }
        return {};
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the cached signatures");
    }
}

void ShardContent::remove(const std::vector<std::int64_t>& shapeIds) {
    if (shapeIds.empty()) return;
    onChanged_(shapeIds);
    std::map<std::size_t, std::vector<std::int64_t>> ofShard;
    for (const std::int64_t id : shapeIds) ofShard[placeOf(id)].push_back(id);
    for (auto& [place, ids] : ofShard) {
        Shard& shard = building_[place];
        shard.settle();
        shard.set = shard.set.with({}, std::move(ids));
    }
}

void ShardContent::drop(const ShardSet& shards) {
    for (std::size_t i = 0; i < building_.size(); ++i) {
        if (shards[i]) building_[i] = {};
    }
}

void ShardContent::show(const ShardSet& complete, std::int64_t number) {
    auto next = std::make_shared<ShownContent>();
    next->content = {complete, number, generation_};
    for (std::size_t i = 0; i < building_.size(); ++i) {
        if (!complete[i]) continue;
        building_[i].settle();
        next->shards[i] = building_[i].set;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    shown_ = std::move(next);
}

ShownPtr ShardContent::shown() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return shown_;
}

}  // namespace shapedb::cluster
