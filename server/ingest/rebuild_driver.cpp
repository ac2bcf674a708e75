// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/rebuild_driver.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/ingest/background_thread.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/crash_marker.h"
#include "server/store/failpoints.h"
#include "server/store/parameters_codec.h"
#include "server/store/quarantine.h"

namespace shapedb::ingest {
namespace {

/// How often a waiting caller checks for cancellation, and for new counts in the store.
constexpr std::chrono::milliseconds kLook{50};
constexpr std::chrono::milliseconds kCount{200};
/// Before another pass when nothing was left but the rebuild could not be finished.
constexpr std::chrono::milliseconds kAnotherPass{50};

/// Deleted with its collection, or done or cancelled though the driver could not see it at once.
bool isOver(const Error& error) {
    return error.code == ErrorCode::kNotFound || error.code == ErrorCode::kRejected;
}

bool sameProgress(const store::Rebuild& a, const store::Rebuild& b) {
    return a.state == b.state && a.done == b.done && a.failed == b.failed && a.total == b.total;
}

std::vector<telemetry::Field> fieldsOf(const store::Rebuild& rebuild, const Error& error) {
    auto fields = telemetry::fieldsOf(error);
    fields.push_back({"rebuild", rebuild.id});
    return fields;
}

}  // namespace

RebuildDriver::RebuildDriver(store::Store& store, index::CollectionIndex& index, WorkerPool& pool,
                             CrashIsolation& isolation, SignaturePipeline pipeline, telemetry::LoggerPtr log,
                             RebuildOptions options)
    : store_(store),
      index_(index),
      pool_(pool),
      isolation_(isolation),
      pipeline_(std::move(pipeline)),
      log_(std::move(log)),
      options_(std::move(options)),
      journal_(options_.journalPath, options_.crashes, log_) {}

RebuildDriver::~RebuildDriver() { stop(); }

Result<void> RebuildDriver::enqueueRunning() {
    const auto running = store_.runningRebuilds();
    RETURN_IF_ERROR(running);
    const std::lock_guard<std::mutex> lock(mutex_);
    queue_.assign(running->begin(), running->end());
    return {};
}

Result<void> RebuildDriver::start() {
    if (const auto queued = enqueueRunning(); !queued) {
        if (queued.error().code != ErrorCode::kDataLoss) return queued;
        log_->error("rebuilds that were running do not go on", telemetry::fieldsOf(queued.error()));
    }
    for (int i = 0; i < std::max(1, options_.threads); ++i) {
        threads_.emplace_back([this] {
            becomeBackgroundThread();
            run();
        });
    }
    return {};
}

Result<store::Rebuild> RebuildDriver::begin(const store::Collection& collection,
                                            const ShapeParameters& parameters) {
    const std::lock_guard<std::mutex> one(beginMutex_);
    const std::string text = store::encodeParameters(parameters);
    const auto running = store_.runningRebuilds();
    RETURN_IF_ERROR(running);
    for (const store::Rebuild& rebuild : *running) {
        if (rebuild.collectionId != collection.id) continue;
        if (rebuild.parameters == text) return rebuild;
        return fail(ErrorCode::kRejected, "a rebuild of collection '" + collection.name +
                                              "' with other parameters is running: wait for it or cancel it");
    }
    auto started = store_.startRebuild(collection.id, text);
    SHAPEDB_FAILPOINT("rebuild.started");
    RETURN_IF_ERROR(started);
    log_->info("rebuild started", {{"collection", collection.name},
                                   {"rebuild", started->id},
                                   {"generation", started->targetGeneration},
                                   {"shapes", started->total}});
    const std::lock_guard<std::mutex> lock(mutex_);
    queue_.push_back(*started);
    changed_.notify_all();
    return started;
}

Result<store::Rebuild> RebuildDriver::waitForChange(const store::Rebuild& seen, const RunContext& context) {
    for (auto nextCount = RunContext::Clock::now();;) {
        RETURN_IF_ERROR(context.checkpoint());
        // Counts are in the store, where nothing announces a change of them.
        if (RunContext::Clock::now() >= nextCount) {
            auto now = store_.getRebuild(seen.id);
            if (!now || !sameProgress(*now, seen)) return now;
            nextCount = RunContext::Clock::now() + kCount;
        }
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait_for(lock, kLook);
    }
}

Result<void> RebuildDriver::cancel(const store::Collection& collection) {
    const std::lock_guard<std::mutex> one(beginMutex_);
    {
        std::unique_lock<std::mutex> lock(mutex_);
        const auto isIts = [&](const store::Rebuild& rebuild) {
            return rebuild.collectionId == collection.id;
        };
        queue_.erase(std::remove_if(queue_.begin(), queue_.end(), isIts), queue_.end());
        if (const ActivePtr active = active_; active && isIts(active->rebuild)) {
            active->cancel = true;
            changed_.notify_all();
            changed_.wait(lock, [&] { return active->inFlight == 0 && !active->reading; });
            if (active_ == active) active_.reset();
            changed_.notify_all();
        }
    }
    const auto running = store_.runningRebuilds();
    RETURN_IF_ERROR(running);
    for (const store::Rebuild& rebuild : *running) {
        if (rebuild.collectionId != collection.id) continue;
        const auto abandoned = store_.abandonRebuild(rebuild.id, store::RebuildState::kCancelled);
        log_->info("rebuild cancelled", {{"collection", collection.name}, {"rebuild", rebuild.id}});
        const std::lock_guard<std::mutex> lock(mutex_);
        changed_.notify_all();
        return abandoned;
    }
    return fail(ErrorCode::kNotFound, "no rebuild of collection '" + collection.name + "' is running");
}

void RebuildDriver::waitUntilQuiet(std::unique_lock<std::mutex>& lock) {
    if (active_) active_->cancel = true;
    changed_.notify_all();
    ++pausing_;
    changed_.wait(lock, [this] { return !active_ || (active_->inFlight == 0 && !active_->reading); });
    --pausing_;
    active_.reset();
    queue_.clear();
}

void RebuildDriver::pause() {
    std::unique_lock<std::mutex> lock(mutex_);
    paused_ = true;
    waitUntilQuiet(lock);
}

bool RebuildDriver::pauseWaits() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return pausing_ > 0;
}

Result<void> RebuildDriver::resume(Content content) {
    if (content == Content::kReplaced) journal_.clear();
    const Result<void> queued = enqueueRunning();
    const std::lock_guard<std::mutex> lock(mutex_);
    paused_ = false;
    changed_.notify_all();
    return queued;
}

void RebuildDriver::stop() {
    {
        std::unique_lock<std::mutex> lock(mutex_);
        stopping_ = true;
        waitUntilQuiet(lock);
    }
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
}

void RebuildDriver::rest(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds time) {
    changed_.wait_for(lock, time, [this] { return stopping_ || paused_ || (active_ && active_->cancel); });
}

void RebuildDriver::run() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return stopping_ || (!paused_ && (active_ || !queue_.empty())); });
        if (stopping_) return;
        const ActivePtr active = activate(lock);
        if (!active) continue;
        if (active->cancel) {
            // The thread that cancelled it waits for the others and clears it.
            changed_.wait(lock, [&] { return stopping_ || active_ != active; });
        } else if (!active->batch.empty()) {
            rebuildOne(active, lock);
        } else if (!active->reading && active->inFlight == 0) {
            readBatch(active, lock);
        } else {
            // Other threads have the rest of the batch, or one reads the next batch.
            changed_.wait(lock, [&] {
                return stopping_ || active_ != active || active->cancel || !active->batch.empty() ||
                       (!active->reading && active->inFlight == 0);
            });
        }
    }
}

/// The rebuild to work on; null when it had to be given up.
RebuildDriver::ActivePtr RebuildDriver::activate(std::unique_lock<std::mutex>& lock) {
    if (active_) return active_;
    const auto active = std::make_shared<Active>();
    active->rebuild = queue_.front();
    queue_.pop_front();
    active_ = active;
    const auto parameters = store::decodeParameters(active->rebuild.parameters);
    if (parameters) {
        active->parameters = *parameters;
        return active;
    }
    log_->error("rebuild abandoned", fieldsOf(active->rebuild, parameters.error()));
    giveUp(active, lock);
    return nullptr;
}

/// Unlocks while it uses the store, where it counts as reading: pausing and cancelling wait for it.
void RebuildDriver::giveUp(const ActivePtr& active, std::unique_lock<std::mutex>& lock) {
    active->reading = true;
    lock.unlock();
    const auto abandoned = store_.abandonRebuild(active->rebuild.id, store::RebuildState::kFailed);
    lock.lock();
    if (!abandoned && !isOver(abandoned.error())) {
        log_->error("rebuild cannot be ended", fieldsOf(active->rebuild, abandoned.error()));
        rest(lock, options_.backOff);
        if (!active->cancel) queue_.push_back(active->rebuild);
    }
    retire(active);
    active->reading = false;
    changed_.notify_all();
}

void RebuildDriver::retire(const ActivePtr& active) {
    if (active_ == active) active_.reset();
}

/// Reads the next shapes, or finishes when there are none. Unlocks while it uses the store.
void RebuildDriver::readBatch(const ActivePtr& active, std::unique_lock<std::mutex>& lock) {
    active->reading = true;
    lock.unlock();
    const auto shapes = store_.rebuildBatch(active->rebuild.id, active->afterId, options_.batch);
    lock.lock();
    if (!shapes) {
        if (isOver(shapes.error())) {
            retire(active);
        } else {
            log_->error("rebuild cannot read its next shapes", fieldsOf(active->rebuild, shapes.error()));
            rest(lock, options_.backOff);
        }
    } else if (!shapes->empty()) {
        active->batch.assign(shapes->begin(), shapes->end());
        active->afterId = shapes->back().id;
    } else if (active->afterId != 0) {
        active->afterId = 0;  // another pass for shapes that were added meanwhile
    } else {
        finish(active, lock);
    }
    active->reading = false;
    changed_.notify_all();
}

void RebuildDriver::finish(const ActivePtr& active, std::unique_lock<std::mutex>& lock) {
    if (active->cancel) return;
    const store::Rebuild& rebuild = active->rebuild;
    lock.unlock();
    const auto finished =
        index_.switchGeneration(rebuild.collectionId, [&] { return store_.finishRebuild(rebuild.id); });
    SHAPEDB_FAILPOINT("rebuild.switched");
    // Only the store knows whether it is done: the reload of the index may have failed afterwards.
    const auto now = store_.getRebuild(rebuild.id);
    lock.lock();
    const bool over =
        now ? now->state != store::RebuildState::kRunning : now.error().code == ErrorCode::kNotFound;
    if (!finished) log_->error("rebuild cannot be finished", fieldsOf(rebuild, finished.error()));
    if (over) {
        if (now)
            log_->info("rebuild done",
                       {{"rebuild", rebuild.id}, {"shapes", now->done}, {"failed", now->failed}});
        retire(active);
    } else {
        rest(lock, finished ? kAnotherPass : options_.backOff);
    }
}

void RebuildDriver::rebuildOne(const ActivePtr& active, std::unique_lock<std::mutex>& lock) {
    const store::Shape shape = std::move(active->batch.front());
    active->batch.pop_front();
    ++active->inFlight;
    lock.unlock();
    if (pool_.running() > 0) {
        lock.lock();
        rest(lock, options_.yield);
        lock.unlock();
    }
    Result<void> stored;
    try {
        if (!active->cancel) stored = isolated(*active, shape);
    } catch (...) {
        stored =
            store_.putRebuildFailure(active->rebuild.id, shape.id, shape.pointsVersion, errorOfException());
    }
    lock.lock();
    if (!stored) {
        auto fields = fieldsOf(active->rebuild, stored.error());
        fields.push_back({"shape", shape.id});
        log_->error("rebuild could not store a result: it will be tried again", fields);
        rest(lock, options_.backOff);
    }
    --active->inFlight;
    changed_.notify_all();
}

/// A scan that was being segmented when the process died runs alone; after too many deaths it runs no more.
Result<void> RebuildDriver::isolated(Active& active, const store::Shape& shape) {
    const store::Deaths deaths = journal_.deaths(shape);
    if (store::isQuarantined(deaths, options_.maxAttempts)) {
        const Error why = store::quarantineError(deaths);
        logQuarantine(*log_, shape, why);
        const auto stored = store_.putRebuildFailure(active.rebuild.id, shape.id, shape.pointsVersion, why);
        // Made only to be acquitted, which takes the deaths off the record.
        CrashJournal::Entry entry(journal_, shape);
        if (stored) entry.acquit();
        return stored;
    }
    const CrashIsolation::Pass pass(isolation_, store::isSuspect(deaths), active.cancel);
    if (!pass.admitted()) return {};
    CrashJournal::Entry entry(journal_, shape);
    const InHand inHand(shape.id, shape.pointsVersion);
    const Result<void> stored = process(active, shape);
    SHAPEDB_FAILPOINT("rebuild.stored");
    if (stored && !active.cancel) entry.acquit();
    return stored;
}

/// Errors: of the store; the next pass brings the shape again.
Result<void> RebuildDriver::process(Active& active, const store::Shape& shape) {
    RunContext context;
    context.cancel = &active.cancel;
    PipelineOutcome made = pipeline_.run(store_, shape.id, active.parameters, context);
    switch (made.kind) {
        case PipelineOutcome::Kind::kSignature:
            return store_.putRebuilt(active.rebuild.id, rowOf(std::move(made), shape.id, shape.pointsVersion,
                                                              active.rebuild.targetGeneration));
        case PipelineOutcome::Kind::kCancelled: return {};
        case PipelineOutcome::Kind::kStoreFailed: return fail(made.why);
        case PipelineOutcome::Kind::kScanFailed: break;
    }
    if (made.why.code == ErrorCode::kNotFound) return {};  // deleted meanwhile
    auto fields = fieldsOf(active.rebuild, made.why);
    fields.push_back({"key", shape.key});
    log_->warn("scan cannot be segmented again", fields);
    return store_.putRebuildFailure(active.rebuild.id, shape.id, shape.pointsVersion, made.why);
}

}  // namespace shapedb::ingest
