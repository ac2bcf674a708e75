// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/cluster/simulated_database.h"

#include <algorithm>
#include <iterator>

namespace shapedb::cluster::sim {

namespace {

Error unreachable() { return {ErrorCode::kUnavailable, "the database is down"}; }

}  // namespace

Database::Database(int replicas) {
    for (int shard = 0; shard < kShards; ++shard) {
        for (int slot = 0; slot < replicas; ++slot) slots_[{shard, slot}];
    }
}

/// The row, if its epoch is still the one seen.
Database::Row* Database::current(const SlotSeen& seen) {
    Row& row = slots_.at({seen.shard, seen.slot});
    return row.epoch == seen.epoch ? &row : nullptr;
}

Result<ClusterView> Database::beat(const Beat& beat) {
    if (down) return tl::make_unexpected(unreachable());
    const Time end = now + beat.term.count();
    if (beat.leaving) {
        alive_.erase(beat.server);
    } else {
        alive_[beat.server] = end;
    }
    for (const SlotSeen& seen : beat.renew) {
        Row* row = current(seen);
        if (row != nullptr && row->holder == beat.server && row->expires > now) row->expires = end;
    }
    const auto give = [&](Row& row, const std::string& to) {
        row = {to, row.epoch + 1, to.empty() ? now : end, {}};
    };
    for (const SlotSeen& seen : beat.take) {
        Row* row = current(seen);
        if (row != nullptr && (row->holder.empty() || row->expires <= now)) give(*row, beat.server);
    }
    for (const SlotSeen& seen : beat.want) {
        Row* row = current(seen);
        if (row != nullptr && row->holder != beat.server) row->wantedBy = beat.server;
    }
    for (const SlotSeen& seen : beat.handOver) {
        Row* row = current(seen);
        if (row != nullptr && row->holder == beat.server) give(*row, row->wantedBy);
    }
    return viewNow();
}

Result<ClusterView> Database::view() {
    if (down) return tl::make_unexpected(unreachable());
    return viewNow();
}

ClusterView Database::viewNow() const {
    ClusterView view;
    for (const auto& [place, row] : slots_) {
        view.leases.push_back({place.first, place.second, row.holder, row.epoch,
                               std::chrono::milliseconds(row.expires - now), row.wantedBy});
    }
    for (const auto& [server, until] : alive_) {
        if (until > now) view.servers.push_back(server);
    }
    return view;
}

bool Database::holds(const std::string& server, int shard, std::int64_t epoch) const {
    for (auto at = slots_.lower_bound({shard, 0}); at != slots_.end() && at->first.first == shard; ++at) {
        const Row& row = at->second;
        if (row.holder == server && row.epoch == epoch && row.expires > now) return true;
    }
    return false;
}

void Database::change(std::int64_t shapeId, std::int64_t version) {
    ++number_;
    log_.push_back(shapeId);
    times_.push_back(now);
    generations_.push_back(generation_);
    if (shapeId != 0) history_[shapeId].push_back({number_, version});
}

void Database::put(std::int64_t shapeId) {
    shapes_[shapeId] = ++version_;
    change(shapeId, version_);
}

void Database::remove(std::int64_t shapeId) {
    if (shapes_.erase(shapeId) > 0) change(shapeId, 0);
}

void Database::switchGeneration() {
    ++generation_;
    change(0, 0);
}

/// The version stands in the place of the points' version, and the generation in its own.
store::IndexRow Database::rowOf(std::int64_t shapeId) const {
    store::IndexRow row;
    row.shapeId = shapeId;
    row.signature.shapeId = shapeId;
    row.signature.generation = generation_;
    row.signature.pointsVersion = shapes_.at(shapeId);
    return row;
}

Result<Changes> Database::changes(std::int64_t /*collectionId*/, std::int64_t after, const ShardSet& shards,
                                  std::size_t limit) {
    if (down) return tl::make_unexpected(unreachable());
    Changes changes;
    changes.at = {number_, generation_};
    changes.forgotten = after < forgotten_;
    if (changes.forgotten) return changes;
    changes.upTo = std::min(number_, after + static_cast<std::int64_t>(limit));
    std::set<std::int64_t> ids;
    for (std::int64_t n = after + 1; n <= changes.upTo; ++n) {
        const std::int64_t id = log_[static_cast<std::size_t>(n)];
        if (id != 0 && shards[static_cast<std::size_t>(shardOf(id))]) ids.insert(id);
    }
    changes.changed.assign(ids.begin(), ids.end());
    for (const std::int64_t id : ids) {
        if (shapes_.count(id) > 0) changes.rows.push_back(rowOf(id));
    }
    return changes;
}

Result<Rows> Database::rows(std::int64_t /*collectionId*/, const ShardSet& shards, std::int64_t afterId,
                            std::size_t limit) {
    if (down) return tl::make_unexpected(unreachable());
    Rows rows;
    rows.at = {number_, generation_};
    rows.last = true;
    for (auto at = shapes_.upper_bound(afterId); at != shapes_.end(); ++at) {
        if (!shards[static_cast<std::size_t>(shardOf(at->first))]) continue;
        if (rows.rows.size() == limit) {
            rows.last = false;
            break;
        }
        rows.rows.push_back(rowOf(at->first));
    }
    return rows;
}

std::string Database::compare(const std::map<std::int64_t, std::int64_t>& shown, const ShardSet& shards,
                              std::int64_t number, std::int64_t upper) const {
    for (const auto& [id, past] : history_) {
        if (!shards[static_cast<std::size_t>(shardOf(id))]) continue;
        const auto found = shown.find(id);
        const std::int64_t version = found == shown.end() ? 0 : found->second;
        // What it was at `number`, or became until `upper`.
        const auto later = std::upper_bound(past.begin(), past.end(), number,
                                            [](std::int64_t n, const Past& one) { return n < one.number; });
        bool had = version == (later == past.begin() ? 0 : std::prev(later)->version);
        for (auto one = later; one != past.end() && one->number <= upper; ++one)
            had |= one->version == version;
        if (!had) {
            return "shape " + std::to_string(id) + " shows version " + std::to_string(version) +
                   ", which it did not have between changes " + std::to_string(number) + " and " +
                   std::to_string(upper);
        }
    }
    for (const auto& [id, version] : shown) {
        if (!shards[static_cast<std::size_t>(shardOf(id))]) {
            return "shape " + std::to_string(id) + " is of a shard that was not asked for";
        }
        if (history_.count(id) == 0) return "shape " + std::to_string(id) + " was never stored";
    }
    return {};
}

std::int64_t Database::numberAt(Time time) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), time);
    return std::max<std::int64_t>(0, after - times_.begin() - 1);
}

std::int64_t Database::generationAt(std::int64_t number) const {
    return generations_[static_cast<std::size_t>(number)];
}

}  // namespace shapedb::cluster::sim
