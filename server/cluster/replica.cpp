// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/replica.h"

#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::cluster {

void Replica::setWanted(const ShardSet& wanted) {
    const ShardSet surplus = (complete_ | loading_) & ~wanted;
    wanted_ = wanted;
    shown_ &= wanted;
    if (surplus.none()) return;
    content_.drop(surplus);
    complete_ &= wanted;
    if ((loading_ & ~wanted).any()) startLoading(loading_ & wanted);
    if (!replacing_) show();
}

void Replica::startLoading(const ShardSet& shards) {
    content_.drop(shards);
    loading_ = shards;
    loadAfter_ = 0;
}

/// Searches see the content that was begun last as soon as it has all that the one before had.
void Replica::show() {
    if (replacing_ && (wanted_ & ~complete_).any()) return;
    replacing_ = false;
    shown_ = complete_;
    number_ = known_;
    content_.show(complete_, known_);
}

Result<bool> Replica::step() {
    if (generation_ == 0) return begin();
    if (loading_.none() && (wanted_ & ~complete_).any()) startLoading(wanted_ & ~complete_);
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
    startLoading(wanted_);
    return true;
}

Result<bool> Replica::load() {
    auto page = source_.rows(collectionId_, loading_, loadAfter_, pageRows_);
    RETURN_IF_ERROR(page);
    if (page->at.generation != generation_) {
        generation_ = 0;
        return true;
    }
    const std::int64_t last = page->rows.empty() ? loadAfter_ : page->rows.back().shapeId;
    RETURN_IF_ERROR(content_.put(std::move(page->rows)));
    loadAfter_ = last;
    if (!page->last) return true;
    complete_ |= loading_;
    loading_.reset();
    show();
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
        RETURN_IF_ERROR(content_.put(std::move(changes->rows)));
        known_ = changes->upTo;
        if (!replacing_) show();
    }
    return loading_.any() || known_ < changes->at.number;
}

}  // namespace shapedb::cluster
