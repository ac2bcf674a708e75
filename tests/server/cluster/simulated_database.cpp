// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/cluster/simulated_database.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <set>

namespace shapedb::cluster::sim {

namespace {

Error unreachable() { return {ErrorCode::kUnavailable, "the database is down"}; }

}  // namespace

Database::Database(int replicas, std::int64_t lastId)
    : replicas_(replicas),
      slots_(static_cast<std::size_t>(kShards * replicas)),
      shapes_(static_cast<std::size_t>(lastId) + 1),
      history_(shapes_.size()) {}

/// The row, if its epoch is still the one seen.
Database::Row* Database::current(const SlotSeen& seen) {
    Row& row = rowAt(seen.shard, seen.slot);
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
    view.leases.reserve(slots_.size());
    for (std::size_t i = 0; i < slots_.size(); ++i) {
        const Row& row = slots_[i];
        const auto place = std::div(static_cast<int>(i), replicas_);
        view.leases.push_back({place.quot, place.rem, row.holder, row.epoch,
                               std::chrono::milliseconds(row.expires - now), row.wantedBy});
    }
    for (const auto& [server, until] : alive_) {
        if (until > now) view.servers.push_back(server);
    }
    return view;
}

bool Database::holds(const std::string& server, int shard, std::int64_t epoch) const {
    for (int slot = 0; slot < replicas_; ++slot) {
        const Row& row = slots_[static_cast<std::size_t>(shard * replicas_ + slot)];
        if (row.holder == server && row.epoch == epoch && row.expires > now) return true;
    }
    return false;
}

void Database::change(std::int64_t shapeId, std::int64_t version) {
    ++number_;
    log_.push_back(shapeId);
    times_.push_back(now);
    generations_.push_back(generation_);
    if (shapeId != 0) history_[static_cast<std::size_t>(shapeId)].push_back({number_, version});
}

void Database::put(std::int64_t shapeId) {
    shapes_[static_cast<std::size_t>(shapeId)] = ++version_;
    change(shapeId, version_);
}

void Database::remove(std::int64_t shapeId) {
    std::int64_t& version = shapes_[static_cast<std::size_t>(shapeId)];
    if (version == 0) return;
    version = 0;
    change(shapeId, 0);
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
    row.signature.pointsVersion = shapes_[static_cast<std::size_t>(shapeId)];
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
        if (shapes_[static_cast<std::size_t>(id)] != 0) changes.rows.push_back(rowOf(id));
    }
    return changes;
}

Result<Rows> Database::rows(std::int64_t /*collectionId*/, const ShardSet& shards, std::int64_t afterId,
                            std::size_t limit) {
    if (down) return tl::make_unexpected(unreachable());
    Rows rows;
    rows.at = {number_, generation_};
    rows.last = true;
    for (auto id = afterId + 1; id < static_cast<std::int64_t>(shapes_.size()); ++id) {
        const bool isThere = shapes_[static_cast<std::size_t>(id)] != 0;
        if (!isThere || !shards[static_cast<std::size_t>(shardOf(id))]) continue;
        if (rows.rows.size() == limit) {
            rows.last = false;
            break;
        }
        rows.rows.push_back(rowOf(id));
        rows.upTo = id;
    }
    return rows;
}

std::string Database::compare(const Versions& shown, const ShardSet& shards, std::int64_t number,
                              std::int64_t upper) const {
    for (std::size_t id = 1; id < shown.size(); ++id) {
        const std::int64_t version = shown[id];
        if (!shards[static_cast<std::size_t>(shardOf(static_cast<std::int64_t>(id)))]) {
            if (version == 0) continue;
            return "shape " + std::to_string(id) + " is of a shard that was not asked for";
        }
        // What it was at `number`, or became until `upper`.
        const std::vector<Past>& past = history_[id];
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
