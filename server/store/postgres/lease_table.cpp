// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/lease_table.h"

#include <algorithm>

#include "server/cluster/shard.h"
#include "server/store/postgres/transactions.h"

namespace shapedb::store {

namespace {

// Whoever changes the tables holds the lock, and whoever waits for it sees what was committed before. Should
// its holder hang, or be cut off, the database ends its transaction. No beat waits for a standby: without it
// searches are to go on, and a lease that a promotion forgets is taken anew. What an answer must know is not
// told by leases, but by the log of changes.
constexpr char kLockLeases[] =
    "SELECT set_config('idle_in_transaction_session_timeout', '2000', true), "
    "set_config('synchronous_commit', 'local', true), pg_advisory_xact_lock(1399350341)";

#define SHAPEDB_CLOCK "CAST(floor(extract(epoch FROM clock_timestamp()) * 1000) AS BIGINT)"
constexpr char kClock[] = "SELECT " SHAPEDB_CLOCK;
// Now; slots that are there, of those that are counted; others that nobody holds; servers that are long dead.
constexpr char kState[] =
    "WITH clock AS MATERIALIZED (SELECT " SHAPEDB_CLOCK
    " AS now) SELECT now, (SELECT count(*) FROM cluster_slot WHERE slot < ?1), (SELECT count(*) FROM "
    "cluster_slot WHERE slot >= ?1 AND (holder = '' OR lease_end <= now)), (SELECT count(*) FROM "
    "cluster_server WHERE until <= now - CAST(?2 AS BIGINT)) FROM clock";
// One that comes later may have been there before: no epoch that it had comes again, because epochs rise more
// slowly than the clock.
constexpr char kAddSlots[] =
    "INSERT INTO cluster_slot (shard, slot, epoch) SELECT shard, slot, CASE WHEN EXISTS (SELECT 1 FROM "
    "cluster_slot) THEN CAST(?3 AS BIGINT) ELSE 0 END FROM generate_series(0, ?1 - 1) shard, "
    "generate_series(0, ?2 - 1) slot ON CONFLICT DO NOTHING";
constexpr char kDeleteSlots[] =
    "DELETE FROM cluster_slot WHERE slot >= ?1 AND (holder = '' OR lease_end <= ?2)";
constexpr char kDeleteServers[] = "DELETE FROM cluster_server WHERE until <= ?1";

constexpr char kAlive[] =
    "INSERT INTO cluster_server (name, until) VALUES (?1, ?2) ON CONFLICT (name) DO UPDATE SET until = "
    "excluded.until";
constexpr char kGone[] = "DELETE FROM cluster_server WHERE name = ?1";

// The rows of slots as they were seen: their shards, numbers and epochs as lists; only numbers below ?4.
#define SHAPEDB_AS_SEEN                                                                                \
    " FROM unnest(string_to_array(?1, ',')::integer[], string_to_array(?2, ',')::integer[], "          \
    "string_to_array(?3, ',')::bigint[]) AS seen (shard, slot, epoch) WHERE s.shard = seen.shard AND " \
    "s.slot = "                                                                                        \
    "seen.slot AND s.epoch = seen.epoch AND s.slot < ?4 AND "
constexpr char kRenew[] =
    "UPDATE cluster_slot s SET lease_end = ?7" SHAPEDB_AS_SEEN "s.holder = ?5 AND s.lease_end > ?6";
constexpr char kTake[] =
    "UPDATE cluster_slot s SET holder = ?5, epoch = s.epoch + 1, lease_end = ?7, wanted_by = "
    "''" SHAPEDB_AS_SEEN "(s.holder = '' OR s.lease_end <= ?6)";
constexpr char kWant[] = "UPDATE cluster_slot s SET wanted_by = ?5" SHAPEDB_AS_SEEN "s.holder <> ?5";
constexpr char kHandOver[] =
    "UPDATE cluster_slot s SET holder = s.wanted_by, epoch = s.epoch + 1, lease_end = CASE s.wanted_by WHEN "
    "'' THEN CAST(?6 AS BIGINT) ELSE CAST(?7 AS BIGINT) END, wanted_by = ''" SHAPEDB_AS_SEEN "s.holder = ?5";

// In no order: the rows of one table of a few pages are not worth a cursor.
constexpr char kSlots[] =
    "SELECT shard, slot, holder, epoch, lease_end - ?2, wanted_by FROM cluster_slot WHERE slot < ?1";
constexpr char kServers[] = "SELECT name FROM cluster_server WHERE until > ?1";

/// After its end nobody counts a server as alive; for people it is there for a while.
constexpr std::int64_t kServersKeptMs = 3'600'000;

template <typename... Values>
void changeSlots(Connection& connection, const char* sql, const std::vector<cluster::SlotSeen>& seen,
                 int replicas, const Values&... values) {
    if (seen.empty()) return;
    std::string shards;
    std::string slots;
    std::string epochs;
    for (const cluster::SlotSeen& one : seen) {
        const char* comma = shards.empty() ? "" : ",";
        shards += comma + std::to_string(one.shard);
        slots += comma + std::to_string(one.slot);
        epochs += comma + std::to_string(one.epoch);
    }
    Query(connection, sql, shards, slots, epochs, replicas, values...).run();
}

struct Prepared {
    std::int64_t now = 0;  ///< by the clock of the database
    bool resized = false;  ///< there were slots of another number of replicas
};

/// The rows of slots are those that are counted, then.
Prepared prepareTables(Connection& connection, int replicas) {
    std::int64_t now = 0;
    bool wasEmpty = false;
    bool isMissing = false;
    bool isSurplus = false;
    bool isForgotten = false;
    {
        Query state(connection, kState, replicas, kServersKeptMs);
        static_cast<void>(state.step());
        now = state.integer(0);
        wasEmpty = state.integer(1) == 0;
        isMissing = state.integer(1) < std::int64_t{cluster::kShards} * replicas;
        isSurplus = state.integer(2) > 0;
        isForgotten = state.integer(3) > 0;
    }
    if (isMissing) Query(connection, kAddSlots, cluster::kShards, replicas, now).run();
    if (isSurplus) Query(connection, kDeleteSlots, replicas, now).run();
    if (isForgotten) Query(connection, kDeleteServers, now - kServersKeptMs).run();
    return {now, (isMissing && !wasEmpty) || isSurplus};
}

void changeTables(Connection& connection, const cluster::Beat& beat, int replicas, std::int64_t now) {
    const std::int64_t end = now + beat.term.count();
    if (beat.leaving) {
        Query(connection, kGone, beat.server).run();
    } else {
        Query(connection, kAlive, beat.server, end).run();
    }
    changeSlots(connection, kRenew, beat.renew, replicas, beat.server, now, end);
    changeSlots(connection, kTake, beat.take, replicas, beat.server, now, end);
    changeSlots(connection, kWant, beat.want, replicas, beat.server);
    changeSlots(connection, kHandOver, beat.handOver, replicas, beat.server, now, end);
}

cluster::ClusterView readTables(Connection& connection, int replicas, std::int64_t now) {
    cluster::ClusterView view;
    // Slots that no beat has made yet are free.
    for (int shard = 0; shard < cluster::kShards; ++shard) {
        for (int slot = 0; slot < replicas; ++slot) {
            cluster::Lease& lease = view.leases.emplace_back();
            lease.shard = shard;
            lease.slot = slot;
        }
    }
    Query slots(connection, kSlots, replicas, now);
    while (slots.step()) {
        const auto place = static_cast<std::size_t>(slots.integer(0) * replicas + slots.integer(1));
        cluster::Lease& lease = view.leases[place];
        lease.holder = slots.text(2);
        lease.epoch = slots.integer(3);
        lease.left = std::chrono::milliseconds(slots.integer(4));
        lease.wantedBy = slots.text(5);
    }
    Query servers(connection, kServers, now);
    while (servers.step()) view.servers.push_back(servers.text(0));
    std::sort(view.servers.begin(), view.servers.end());
    return view;
}

}  // namespace

Result<cluster::ClusterView> PostgresLeaseTable::beat(const cluster::Beat& beat) {
    return guarded("renew the leases of shards", [&] {
        cluster::ClusterView view;
        inWriteTransaction(pool_, false, [&](Connection& connection) {
            Query(connection, kLockLeases).run();
            const Prepared prepared = prepareTables(connection, replicas_);
            changeTables(connection, beat, replicas_, prepared.now);
            view = readTables(connection, replicas_, prepared.now);
            view.resized = prepared.resized;
        });
        return view;
    });
}

Result<cluster::ClusterView> PostgresLeaseTable::view() {
    return guarded("read the leases of shards", [&] {
        cluster::ClusterView view;
        inReadTransaction(pool_, [&](Connection& connection) {
            view = readTables(connection, replicas_, numberOf(Query(connection, kClock)));
        });
        return view;
    });
}

}  // namespace shapedb::store
