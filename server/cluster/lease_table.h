// SPDX-License-Identifier: GPL-3.0-or-later
// Who holds which shard: a table of leases in the database that all servers share.
//
// A shard has as many slots as it has replicas. A lease is of one slot, to one server, for a while by the
// clock of the database; it ends unless its holder renews it. Whenever a slot changes hands its epoch rises
// by one, so that an answer of a holder that has lost it is known by its epoch.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb::cluster {

struct Lease {
    int shard = 0;           ///< in [0, kShards)
    int slot = 0;            ///< in [0, replicas)
    std::string holder;      ///< a server's name; empty: nobody has had it yet, or it was given back
    std::int64_t epoch = 0;  ///< rises with each change of hands; 0: nobody has had it yet
    /// Left by the clock of the database when the row was read; not above 0: it has ended.
    std::chrono::milliseconds left{0};
    /// Who has loaded the shard and waits for the holder to hand it over; empty: nobody.
    std::string wantedBy;
};

/// A slot as the one who asks has seen it.
struct SlotSeen {
    int shard = 0;
    int slot = 0;
    std::int64_t epoch = 0;
};

/// What a server tells and asks of the table at once. Entries whose epoch is no longer that of the row change
/// nothing.
struct Beat {
    std::string server;                ///< its name; it counts as alive for the length of a lease from now on
    std::chrono::milliseconds term{};  ///< length of a lease
    bool leaving = false;              ///< it does not count as alive any more
    std::vector<SlotSeen> renew;       ///< its own leases; those that have ended are not renewed
    std::vector<SlotSeen> take;        ///< if nobody holds them now: becomes the holder
    std::vector<SlotSeen> want;        ///< held by others: asks to be the next
    std::vector<SlotSeen> handOver;    ///< its own: to who wants them; nobody's, if nobody does
};

/// The table after a beat, in order of shard and slot, and the names of the servers that are alive, in order.
struct ClusterView {
    std::vector<Lease> leases;
    std::vector<std::string> servers;
    /// This beat made or removed slots because another server has, or had, another number of replicas.
    bool resized = false;
};

/// Thread-safe.
class LeaseTable {
  public:
    virtual ~LeaseTable() = default;
    /// In one transaction. Errors: those of the database; then it may have taken place or not.
    [[nodiscard]] virtual Result<ClusterView> beat(const Beat& beat) = 0;
    /// Reads only. Errors: those of the database.
    [[nodiscard]] virtual Result<ClusterView> view() = 0;
};

}  // namespace shapedb::cluster
