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

tl::unexpected<Error> outOfMemory() {
    return fail(ErrorCode::kOutOfMemory, "not enough memory for the cached signatures");
}

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
    takeIn();
    failure_.reset();
    generation_ = generation;
    building_ = {};
}

ShardContent::Decoded ShardContent::decode(std::vector<store::IndexRow> rows) const {
    try {
        std::vector<IndexEntry> entries(rows.size());
        std::vector<char> good(rows.size());
        RETURN_IF_ERROR(
            parallelFor(rows.size(), kDecodedTogether, {}, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    good[i] = index::toEntry(std::move(rows[i]), entries[i], *log_) ? 1 : 0;
                }
            }));
        std::size_t kept = 0;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (good[i] != 0) std::swap(entries[kept++], entries[i]);
        }
        entries.resize(kept);
        return entries;
    } catch (const std::bad_alloc&) {
        return outOfMemory();
    }
}

void ShardContent::append(std::vector<IndexEntry> entries) {
    for (IndexEntry& entry : entries) {
        Shard& shard = building_[placeOf(entry.id)];
        const bool follows = entry.id > shard.lastId();
        if (!follows) shard.settle();
        shard.waiting.push_back(std::move(entry));
        if (!follows || shard.waiting.size() >= kWorthABlock) shard.settle();
    }
}

void ShardContent::takeIn() {
    if (!decoding_.valid()) return;
    Decoded decoded = decoding_.get();
    if (!decoded) {
        failure_ = decoded.error();
        return;
    }
    try {
        append(std::move(*decoded));
    } catch (const std::bad_alloc&) {
        failure_ = outOfMemory().value();
    }
}

Result<void> ShardContent::put(std::vector<store::IndexRow> rows) {
    takeIn();
    if (failure_) return fail(*failure_);
    if (rows.empty()) return {};
    try {
        decoding_ = std::async(std::launch::async,
                               [this, rows = std::move(rows)]() mutable { return decode(std::move(rows)); });
        return {};
    } catch (const std::exception&) {
        return outOfMemory();  // also: no thread can be started
    }
}

void ShardContent::remove(const std::vector<std::int64_t>& shapeIds) {
    if (shapeIds.empty()) return;
    takeIn();
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
    takeIn();
    for (std::size_t i = 0; i < building_.size(); ++i) {
        if (shards[i]) building_[i] = {};
    }
}

Result<void> ShardContent::show(const ShardSet& complete, std::int64_t number) {
    takeIn();
    if (failure_) return fail(*failure_);
    auto next = std::make_shared<ShownContent>();
    next->content = {complete, number, generation_};
    for (std::size_t i = 0; i < building_.size(); ++i) {
        if (!complete[i]) continue;
        building_[i].settle();
        next->shards[i] = building_[i].set;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    shown_ = std::move(next);
    return {};
}

ShownPtr ShardContent::shown() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return shown_;
}

}  // namespace shapedb::cluster
