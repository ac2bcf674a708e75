// SPDX-License-Identifier: GPL-3.0-or-later
// This server as a member of a cluster: it takes and renews the leases of its shards (lease_keeper.h), loads
// their signatures and follows the changes (replica.h), and tells who holds the others.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/cluster/gather.h"
#include "server/cluster/lease_keeper.h"
#include "server/cluster/replica.h"
#include "server/cluster/shard_content.h"
#include "server/telemetry/logger.h"

namespace shapedb::cluster {

/// Thread-safe between `start` and `stop`, which belong to one thread.
class Member {
  public:
    struct Parts {
        std::unique_ptr<LeaseTable> leases;
        std::unique_ptr<ReplicaSource> source;
        /// The ids of all collections, as this server knows them now.
        std::function<std::vector<std::int64_t>()> collections;
        /// As that of ShardContent.
        std::function<void(const std::vector<std::int64_t>&)> onChanged;
        telemetry::LoggerPtr log;
    };

    Member(Parts parts, KeeperOptions options);
    ~Member() { stop(); }
    Member(const Member&) = delete;
    Member& operator=(const Member&) = delete;

    /// Joins the cluster: from now on others may ask this server. Errors: those of the lease table.
    [[nodiscard]] Result<void> start();
    /// Hands its shards over to who waits for them, for as long as a lease at most, and leaves.
    void leave();
    /// Stops all threads. Leases that are left end by themselves.
    void stop();

    /// Its name, as the lease table has it.
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::chrono::milliseconds term() const { return term_; }
    /// Another number for each request (Gather).
    [[nodiscard]] std::uint64_t nextTurn() { return turns_.fetch_add(1); }
    /// Who holds what, as it was last read.
    [[nodiscard]] RoutesPtr routes() const;
    /// The same, read now. Errors: those of the lease table.
    [[nodiscard]] Result<RoutesPtr> readRoutes();

    /// What a search reads that asks this server: waits a little for changes that it does not know yet.
    /// Errors: kUnavailable (it may not answer `ask`), kNotReady (it still reads what has changed), those of
    /// `context`.
    [[nodiscard]] Result<ShownPtr> content(std::int64_t collectionId, const Ask& ask,
                                           const RunContext& context);

    struct State {
        std::size_t held = 0;       ///< shards that it may answer for
        std::size_t wanted = 0;     ///< shards that it should hold
        std::size_t uncovered = 0;  ///< shards that nobody holds
        std::uint64_t signatures = 0;
        std::uint64_t bytes = 0;  ///< of these, approximate
        bool following = true;    ///< the database could be read lately
        bool current = true;      ///< the table of leases, too: within the length of one
    };
    [[nodiscard]] State state() const;

  private:
    static Instant now();
    Result<void> beatOnce();
    void beatLoop();
    void followLoop();
    /// One step of each collection. True if there is more to do now.
    bool followOnce(const ShardSet& wanted, bool first);
    bool isNews(const Ask& ask) const;
    void noteProgress(const ShardSet& loaded, bool followed);

    Parts parts_;
    const std::string name_;
    const std::chrono::milliseconds term_;
    std::atomic<std::uint64_t> turns_{0};
    std::mutex beating_;  ///< one beat at a time

    mutable std::mutex mutex_;  ///< guards all below but `replicas_`
    std::condition_variable changed_;
    LeaseKeeper keeper_;
    RoutesPtr routes_;
    Instant nextWarning_{};  ///< about another number of replicas, not before
    Instant viewedAt_{};     ///< when the beat was sent that saw the table of leases last
    ShardSet loaded_;
    std::map<std::int64_t, std::shared_ptr<ShardContent>> contents_;
    std::uint64_t news_ = 0;  ///< rises with each beat, and each pass of the thread that follows
    bool following_ = true;
    bool wake_ = false;      ///< the thread that follows should go on at once
    bool beatSoon_ = false;  ///< the thread that beats should
    bool stop_ = false;

    struct Following {
        std::unique_ptr<Replica> replica;
        std::shared_ptr<ShardContent> content;
        bool counts = true;  ///< shards are not taken before it has them
    };
    std::map<std::int64_t, Following> replicas_;  ///< of the thread that follows alone
    std::thread beats_;
    std::thread follows_;
};

}  // namespace shapedb::cluster
