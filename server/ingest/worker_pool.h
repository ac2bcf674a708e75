// SPDX-License-Identifier: GPL-3.0-or-later
// The workers that turn stored scans into signatures.
//
// A job is claimed, segmented and its result committed in the store; then the index is refreshed
// and watchers are notified. A crash at any point leaves the job in the store for the next start.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "server/index/collection_index.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/progress_board.h"
#include "server/ingest/signature_pipeline.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

struct WorkerOptions {
    int threads = 1;                    ///< at least 1
    int maxAttempts = 2;                ///< as Store::recoverJobs
    std::vector<store::Crash> crashes;  ///< of the last process
    /// How long a worker waits after an error of the store.
    std::chrono::milliseconds backOff{1'000};
};

/// What the store holds after a pause.
enum class Content {
    kSame,
    kReplaced,  ///< by a restore (Store::restore)
};

/// Thread-safe unless a function says otherwise.
class WorkerPool {
  public:
    /// The references are not owned and must outlive the pool.
    WorkerPool(store::Store& store, index::CollectionIndex& index, ProgressBoard& board,
               CrashIsolation& isolation, SignaturePipeline pipeline, telemetry::LoggerPtr log,
               WorkerOptions options);
    /// As `stop`.
    ~WorkerPool();

    /// Recovers the jobs of a dead process (Store::recoverJobs) and starts the workers. Scans set aside
    /// leave the index, which must be loaded. If the jobs are damaged, it starts without them (`trouble`).
    /// Call once. Errors: as Store::recoverJobs, other than kDataLoss.
    [[nodiscard]] Result<void> start();

    /// Call after a job was queued.
    void wake();

    /// Call after the shape was deleted, or its points replaced by those of `newPointsVersion`: a
    /// worker that still has older points stops.
    void supersede(std::int64_t shapeId,
                   std::int64_t newPointsVersion = std::numeric_limits<std::int64_t>::max());

    /// Call after the collection was deleted.
    void supersedeCollection(std::int64_t collectionId);

    /// Stops claiming and puts running jobs back; returns when no worker uses the store.
    void pause();
    /// Continues after `pause`. Replaced content is recovered as at the start. Errors: as `start`; it has
    /// continued all the same.
    [[nodiscard]] Result<void> resume(Content content);
    /// As `pause`, and ends the threads. Idempotent.
    void stop();

    /// Whether `pause` or `stop` has been called and waits for a worker.
    [[nodiscard]] bool pauseWaits() const;
    /// Why no jobs are taken any more, which names what to do: those stored are damaged. Empty: all is well.
    /// A restore ends it.
    [[nodiscard]] std::optional<Error> trouble() const;
    [[nodiscard]] std::size_t running() const;
    /// Jobs since start that ended in a signature.
    [[nodiscard]] std::uint64_t ingested() const { return ingested_.load(); }
    /// About how long until a full queue of `jobs` has room again: the hint for refused callers.
    [[nodiscard]] std::chrono::milliseconds retryAfter(std::uint64_t jobs) const;

  private:
    struct Running {
        store::Job job;
        std::atomic<bool> cancel{false};
        std::atomic<bool> superseded{false};  ///< set before cancel
    };
    /// Settled in the store; to be put back; to be put back after a rest.
    enum class Outcome { kDone, kPutBack, kStoreFailed };

    static void markSuperseded(Running& running);
    bool mayClaim() const;
    void run();
    std::shared_ptr<Running> next(std::optional<CrashIsolation::Pass>& pass);
    Result<std::optional<store::Job>> claim(std::unique_lock<std::mutex>& lock);
    void retryReleases(std::unique_lock<std::mutex>& lock);
    Outcome work(Running& running, bool admitted);
    Outcome attempt(Running& running);
    Outcome cancelled(const Running& running);
    Outcome commit(const Running& running, std::int64_t generation, PipelineOutcome made);
    Outcome giveUp(const store::Job& job, const Error& why);
    void stopSearching(const store::Shape& failed);
    void putBack(const store::Job& job);
    void rest(std::unique_lock<std::mutex>& lock);
    Result<void> recover();
    void takeOutOfService(const Error& why);

    store::Store& store_;
    index::CollectionIndex& index_;
    ProgressBoard& board_;
    CrashIsolation& isolation_;
    SignaturePipeline pipeline_;
    telemetry::LoggerPtr log_;
    WorkerOptions options_;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::uint64_t signals_ = 0;        ///< rises when there may be a job
    std::atomic<bool> paused_{false};  ///< changes under mutex_
    bool stopping_ = false;
    std::optional<Error> trouble_;
    /// True from the start until the first job that no dead process was segmenting (those come first,
    /// being older): jobs run one at a time and alone, so that a deadly one dies alone.
    bool probing_ = true;
    int pausing_ = 0;   ///< calls inside `pause`
    int claiming_ = 0;  ///< workers in the store without a job
    /// One for each worker that is segmenting a scan. Not by job: a job that was put back may be with its
    /// next worker before the last one has left.
    std::set<std::shared_ptr<Running>> running_;
    std::vector<store::Job> unreleased_;  ///< jobs the store would not take back yet
    double secondsPerJob_ = 1.0;          ///< running mean
    std::vector<std::thread> threads_;
    std::atomic<std::uint64_t> ingested_{0};
};

}  // namespace shapedb::ingest
