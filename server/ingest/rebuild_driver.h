// SPDX-License-Identifier: GPL-3.0-or-later
// Segments whole collections again in the background, into a new generation of signatures that
// replaces the serving one when it is complete.
//
// Progress is in the store, shape by shape: after a restart a rebuild continues where it was.
// Rebuilds run one after another, in the order of their requests.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/index/collection_index.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/crash_journal.h"
#include "server/ingest/signature_pipeline.h"
#include "server/ingest/worker_pool.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

struct RebuildOptions {
    int threads = 1;          ///< at least 1
    int maxAttempts = 2;      ///< deaths of the process after which a scan is quarantined
    std::string journalPath;  ///< file of the CrashJournal
    std::size_t batch = 32;   ///< shapes read from the store at once
    /// While uploads are being segmented, each rebuild thread waits this long before its next
    /// shape: uploads come first, and the rebuild still ends.
    std::chrono::milliseconds yield{100};
    std::vector<store::Crash> crashes;  ///< of the last process
    /// How long a thread waits after an error of the store.
    std::chrono::milliseconds backOff{1'000};
};

/// Thread-safe unless a function says otherwise.
class RebuildDriver {
  public:
    /// The references are not owned and must outlive the driver.
    RebuildDriver(store::Store& store, index::CollectionIndex& index, WorkerPool& pool,
                  CrashIsolation& isolation, SignaturePipeline pipeline, telemetry::LoggerPtr log,
                  RebuildOptions options);
    /// As `stop`.
    ~RebuildDriver();

    /// Continues what a dead process left running; what cannot be read for damage is logged and left. Call
    /// once. Errors: as Store::runningRebuilds, other than kDataLoss.
    [[nodiscard]] Result<void> start();

    /// Starts a rebuild, or returns the running one with the same parameters.
    /// Errors: kNotFound (collection); kRejected: one with other parameters is running.
    [[nodiscard]] Result<store::Rebuild> begin(const store::Collection& collection,
                                               const ShapeParameters& parameters);

    /// Waits until counts or state differ from those of `seen`. Errors: kNotFound; kCancelled,
    /// kDeadlineExceeded (of the waiting, not of the rebuild).
    [[nodiscard]] Result<store::Rebuild> waitForChange(const store::Rebuild& seen, const RunContext& context);

    /// Stops the collection's rebuild and deletes its results. Errors: kNotFound (none is running).
    [[nodiscard]] Result<void> cancel(const store::Collection& collection);

    /// Returns when no thread uses the store.
    void pause();
    /// Whether `pause` or `stop` has been called and waits for a thread.
    [[nodiscard]] bool pauseWaits() const;
    /// Continues with the rebuilds that the store calls running. Deaths are on record for the content they
    /// were counted with. Errors: as Store::runningRebuilds.
    [[nodiscard]] Result<void> resume(Content content);
    /// As `pause`, and ends the threads; the next start continues. Idempotent.
    void stop();

  private:
    struct Active {
        store::Rebuild rebuild;
        ShapeParameters parameters;
        std::deque<store::Shape> batch;
        std::int64_t afterId = 0;
        int inFlight = 0;      ///< threads working on one of its shapes
        bool reading = false;  ///< a thread is reading the next batch, or ending the rebuild
        std::atomic<bool> cancel{false};
    };
    using ActivePtr = std::shared_ptr<Active>;

    void run();
    ActivePtr activate(std::unique_lock<std::mutex>& lock);
    void readBatch(const ActivePtr& active, std::unique_lock<std::mutex>& lock);
    void finish(const ActivePtr& active, std::unique_lock<std::mutex>& lock);
    void giveUp(const ActivePtr& active, std::unique_lock<std::mutex>& lock);
    void rebuildOne(const ActivePtr& active, std::unique_lock<std::mutex>& lock);
    Result<void> isolated(Active& active, const store::Shape& shape);
    Result<void> process(Active& active, const store::Shape& shape);
    void retire(const ActivePtr& active);
    void rest(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds time);
    void waitUntilQuiet(std::unique_lock<std::mutex>& lock);
    Result<void> enqueueRunning();

    store::Store& store_;
    index::CollectionIndex& index_;
    WorkerPool& pool_;
    CrashIsolation& isolation_;
    SignaturePipeline pipeline_;
    telemetry::LoggerPtr log_;
    RebuildOptions options_;
    CrashJournal journal_;

    std::mutex beginMutex_;  ///< one `begin` or `cancel` at a time; taken before mutex_
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<store::Rebuild> queue_;
    ActivePtr active_;
    int pausing_ = 0;  ///< calls inside `pause` or `stop`
    bool paused_ = false;
    bool stopping_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace shapedb::ingest
