// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/replica.h"

#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::cluster {

namespace {

/// Shards that are read in one pass over the shapes of the collection, and shown when it ends. Fewer are
/// there sooner, and each pass also costs a look at the ids of all others.
constexpr std::size_t kLoadedTogether = 64;

}  // namespace

void Replica::setWanted(const ShardSet& wanted) {
    const ShardSet surplus = (complete_ | loading_) & ~wanted;
    wanted_ = wanted;
    shown_ &= wanted;
    if (surplus.none()) return;
    content_.drop(surplus);
    complete_ &= wanted;
    if ((loading_ & ~wanted).any()) startLoading(loading_ & wanted);
    if (!replacing_) static_cast<void>(show());  // after an error the next step begins again
}

/// The next ones that are not there yet. Nothing is gained by some of them where an older generation is shown
/// until all are there.
ShardSet Replica::toLoad() const {
    const std::size_t most = replacing_ ? kShards : kLoadedTogether;
    ShardSet next;
    for (std::size_t shard = 0; shard < next.size() && next.count() < most; ++shard) {
        if (wanted_[shard] && !complete_[shard]) next.set(shard);
    }
    return next;
}

void Replica::startLoading(const ShardSet& shards) {
    content_.drop(shards);
    loading_ = shards;
    loadAfter_ = 0;
}

/// Searches see the content that was begun last as soon as it has all that the one before had.
Result<void> Replica::show() {
    if (replacing_ && (wanted_ & ~complete_).any()) return {};
    const auto done = content_.show(complete_, known_);
    if (!done) {
        generation_ = 0;
        return done;
    }
    replacing_ = false;
    shown_ = complete_;
    number_ = known_;
    return {};
}

Result<void> Replica::put(std::vector<store::IndexRow> rows) {
    auto done = content_.put(std::move(rows));
    if (!done) generation_ = 0;
    return done;
}

Result<bool> Replica::step() {
    if (generation_ == 0) return begin();
    if (loading_.none() && toLoad().any()) startLoading(toLoad());
    if (loading_.none()) return follow();
    followNext_ = !followNext_;
    return followNext_ ? load() : follow();
}

/// Where the content starts. The rows are read afterwards: what changes meanwhile is among the changes after
/// this position.
Result<bool> Replica::begin() {
    const auto none = source_.rows(collectionId_, ShardSet(), 0, 0);
    RETURN_IF_ERROR(none);
    content_.begin(none->at.generation);
    replacing_ = shown_.any();
    generation_ = none->at.generation;
    known_ = none->at.number;
    complete_.reset();
    startLoading(toLoad());
    return true;
}

Result<bool> Replica::load() {
    auto page = source_.rows(collectionId_, loading_, loadAfter_, pageRows_);
    RETURN_IF_ERROR(page);
    if (page->at.generation != generation_) {
        generation_ = 0;
        return true;
    }
    RETURN_IF_ERROR(put(std::move(page->rows)));
    loadAfter_ = page->upTo;
    if (!page->last) return true;
    complete_ |= loading_;
    loading_.reset();
    RETURN_IF_ERROR(show());
    return true;
}

/// Also while shards are loaded: the changes of these are applied too, so that a page that was read before a
/// change does not outlive it.
Result<bool> Replica::follow() {
    auto changes = source_.changes(collectionId_, known_, complete_ | loading_, pageRows_);
    RETURN_IF_ERROR(changes);
    if (changes->forgotten || changes->at.generation != generation_) {
        generation_ = 0;
        return true;
    }
    if (changes->upTo > known_) {
        content_.remove(changes->changed);
        RETURN_IF_ERROR(put(std::move(changes->rows)));
        known_ = changes->upTo;
        if (!replacing_) RETURN_IF_ERROR(show());
    }
    return loading_.any() || known_ < changes->at.number;
}

}  // namespace shapedb::cluster
