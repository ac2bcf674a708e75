// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/worker_pool.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/ingest/background_thread.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/crash_marker.h"
#include "server/store/failpoints.h"
#include "server/store/quarantine.h"

namespace shapedb::ingest {
namespace {

/// Weight of the newest job in the running mean of job times.
constexpr double kNewest = 0.1;
constexpr std::chrono::milliseconds kShortestHint{100};
constexpr std::chrono::milliseconds kLongestHint{60'000};

std::vector<telemetry::Field> fieldsOf(const store::Job& job, const Error& error) {
    auto fields = telemetry::fieldsOf(error);
    fields.push_back({"job", job.id});
    fields.push_back({"shape", job.shapeId});
    return fields;
}

}  // namespace

WorkerPool::WorkerPool(store::Store& store, index::CollectionIndex& index, ProgressBoard& board,
                       CrashIsolation& isolation, SignaturePipeline pipeline, telemetry::LoggerPtr log,
                       WorkerOptions options)
    : store_(store),
      index_(index),
      board_(board),
      isolation_(isolation),
      pipeline_(std::move(pipeline)),
      log_(std::move(log)),
      options_(std::move(options)) {}

WorkerPool::~WorkerPool() { stop(); }

Result<void> WorkerPool::recover() {
    // The crashes count once only: jobs that come with a restore are another server's.
    const auto quarantined = store_.recoverJobs(options_.maxAttempts, std::exchange(options_.crashes, {}));
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        trouble_.reset();
        if (!quarantined && quarantined.error().code == ErrorCode::kDataLoss) {
            takeOutOfService(quarantined.error());
            return {};
        }
    }
    RETURN_IF_ERROR(quarantined);
    for (const store::Shape& shape : *quarantined) {
        if (shape.failure) logQuarantine(*log_, shape, *shape.failure);
        stopSearching(shape);
        board_.settled(shape.id);
    }
    return {};
}

/// Under the lock. To try again and again would only fill the log: damage does not go away by itself.
void WorkerPool::takeOutOfService(const Error& why) {
    trouble_ = Error{why.code, "no scan is taken in, the queue is damaged: " + why.message};
    log_->error("segmentation is out of service; searches are answered", telemetry::fieldsOf(*trouble_));
}

std::optional<Error> WorkerPool::trouble() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return trouble_;
}

Result<void> WorkerPool::start() {
    RETURN_IF_ERROR(recover());
    for (int i = 0; i < std::max(1, options_.threads); ++i) {
        threads_.emplace_back([this] {
            becomeBackgroundThread();
            run();
        });
    }
    return {};
}

void WorkerPool::wake() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++signals_;
    changed_.notify_all();
}

void WorkerPool::supersede(std::int64_t shapeId, std::int64_t newPointsVersion) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& running : running_) {
        if (running->job.shapeId == shapeId && running->job.pointsVersion < newPointsVersion) {
            markSuperseded(*running);
        }
    }
}

void WorkerPool::supersedeCollection(std::int64_t collectionId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& running : running_) {
        if (running->job.collectionId == collectionId) markSuperseded(*running);
    }
}

void WorkerPool::markSuperseded(Running& running) {
    running.superseded = true;
    running.cancel = true;
}

void WorkerPool::pause() {
    std::unique_lock<std::mutex> lock(mutex_);
    paused_ = true;
    for (const auto& running : running_) running->cancel = true;
    changed_.notify_all();
    ++pausing_;
    changed_.wait(lock, [this] { return running_.empty() && claiming_ == 0; });
    --pausing_;
}

Result<void> WorkerPool::resume(Content content) {
    Result<void> recovered;
    if (content == Content::kReplaced) {
        {
            // They are jobs of the old content.
            const std::lock_guard<std::mutex> lock(mutex_);
            unreleased_.clear();
        }
        recovered = recover();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    paused_ = false;
    if (content == Content::kReplaced) probing_ = true;
    ++signals_;
    changed_.notify_all();
    return recovered;
}

void WorkerPool::stop() {
    pause();
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopping_ = true;
        changed_.notify_all();
    }
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
    // A last time: what stays claimed would count as a death of this process at the next start.
    std::unique_lock<std::mutex> lock(mutex_);
    if (!unreleased_.empty()) retryReleases(lock);
}

bool WorkerPool::pauseWaits() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return pausing_ > 0;
}

std::size_t WorkerPool::running() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return running_.size();
}

std::chrono::milliseconds WorkerPool::retryAfter(std::uint64_t jobs) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Wait for a tenth of the queue: if every free place invited everybody, most uploads would be
    // in vain.
    const double places = std::max(1.0, 0.1 * static_cast<double>(jobs));
    const double milliseconds = 1'000.0 * secondsPerJob_ * places / std::max(1, options_.threads);
    const auto hint = std::chrono::milliseconds(
        static_cast<std::int64_t>(std::min(milliseconds, static_cast<double>(kLongestHint.count()))));
    return std::clamp(hint, kShortestHint, kLongestHint);
}

void WorkerPool::run() {
    for (;;) {
        std::optional<CrashIsolation::Pass> pass;
        const std::shared_ptr<Running> running = next(pass);
        if (!running) return;
        const Outcome outcome = work(*running, pass.has_value());
        pass.reset();
        std::unique_lock<std::mutex> lock(mutex_);
        running_.erase(running);
        changed_.notify_all();
        // No longer counted as running: a drain does not wait for the rest.
        if (outcome == Outcome::kStoreFailed) rest(lock);
        if (outcome != Outcome::kDone) ++signals_;
        changed_.notify_all();
    }
}

void WorkerPool::rest(std::unique_lock<std::mutex>& lock) {
    changed_.wait_for(lock, options_.backOff, [this] { return stopping_ || paused_; });
}

/// Jobs the store refused to take back are still claimed there; nobody else would free them.
void WorkerPool::retryReleases(std::unique_lock<std::mutex>& lock) {
    const std::vector<store::Job> jobs = std::exchange(unreleased_, {});
    lock.unlock();
    std::vector<store::Job> still;
    for (const store::Job& job : jobs) {
        const auto released = store_.releaseJob(job);
        if (!released && released.error().code != ErrorCode::kNotFound) still.push_back(job);
    }
    lock.lock();
    unreleased_.insert(unreleased_.end(), still.begin(), still.end());
}

/// Claims without the lock. After an error of the store it rests and signals to look again.
Result<std::optional<store::Job>> WorkerPool::claim(std::unique_lock<std::mutex>& lock) {
    if (!unreleased_.empty()) retryReleases(lock);
    lock.unlock();
    auto job = store_.claimJob();
    lock.lock();
    if (job) return job;
    if (job.error().code == ErrorCode::kDataLoss) {
        takeOutOfService(job.error());
        return job;
    }
    log_->error("cannot take the next job", telemetry::fieldsOf(job.error()));
    rest(lock);
    ++signals_;
    return job;
}

bool WorkerPool::mayClaim() const {
    return !paused_ && !trouble_ && (!probing_ || (claiming_ == 0 && running_.empty()));
}

/// Blocks until there is a job that this worker may have; null when the pool stops. Without a pass the job
/// was cancelled before its turn.
std::shared_ptr<WorkerPool::Running> WorkerPool::next(std::optional<CrashIsolation::Pass>& pass) {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return stopping_ || mayClaim(); });
        if (stopping_) return nullptr;
        // Before the claim: a job that is queued in between raises it, and the wait below ends at once.
        const std::uint64_t seen = signals_;
        const bool probing = probing_;
        ++claiming_;
        lock.unlock();
        // Before the claim: a claimed job would count as tried if a suspect of a rebuild brought the
        // process down while this one waited for its turn.
        if (probing) pass.emplace(isolation_, true, paused_);
        lock.lock();
        if (pass && !pass->admitted()) {
            pass.reset();
            --claiming_;
            changed_.notify_all();
            continue;
        }
        const auto job = claim(lock);
        --claiming_;
        // This attempt is counted already.
        const bool suspect = job && *job && store::isSuspect({(*job)->attempts - 1, (*job)->stops});
        if (job && !suspect) probing_ = false;
        changed_.notify_all();
        if (!suspect) pass.reset();
        if (job && *job) {
            auto running = std::make_shared<Running>();
            running->job = **job;
            running->cancel = paused_.load();  // paused while claiming: straight back
            running_.insert(running);
            lock.unlock();
            if (!pass) pass.emplace(isolation_, suspect, running->cancel);
            if (!pass->admitted()) pass.reset();
            return running;
        }
        changed_.wait(lock, [&] { return stopping_ || paused_ || signals_ != seen; });
    }
}

WorkerPool::Outcome WorkerPool::work(Running& running, bool admitted) {
    const auto began = std::chrono::steady_clock::now();
    const store::Job& job = running.job;
    Outcome outcome = Outcome::kDone;
    try {
        outcome = admitted ? attempt(running) : cancelled(running);
    } catch (...) {
        // An exception that left the thread would end the process.
        outcome = giveUp(job, errorOfException());
    }
    // Before it is put back: what is reported from then on is of the next worker.
    board_.settled(job.shapeId);
    if (outcome != Outcome::kDone) {
        putBack(job);
        return outcome;
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - began;
    const std::lock_guard<std::mutex> lock(mutex_);
    secondsPerJob_ += kNewest * (seconds.count() - secondsPerJob_);
    return outcome;
}

WorkerPool::Outcome WorkerPool::attempt(Running& running) {
    const store::Job& job = running.job;
    const auto collection = index_.byId(job.collectionId);
    if (!collection) {
        // Deleted together with its jobs, or the index could not be loaded after a restore.
        const bool gone = [&] {
            const auto shape = store_.getShapeById(job.shapeId);
            return !shape && shape.error().code == ErrorCode::kNotFound;
        }();
        return gone ? giveUp(job, collection.error()) : Outcome::kStoreFailed;
    }
    if (const auto known = (*collection)->requireParameters(); !known) return giveUp(job, known.error());
    const InHand inHand(job.shapeId, job.pointsVersion);
    RunContext context;
    context.cancel = &running.cancel;
    context.progress = [this, &job](const char* stage, std::uint64_t done, std::uint64_t total) {
        board_.report(job.shapeId, stage, done, total);
    };
    SHAPEDB_FAILPOINT("worker.claimed");
    PipelineOutcome made = pipeline_.run(store_, job.shapeId, (*collection)->parameters, context);
    SHAPEDB_FAILPOINT("worker.segmented");
    switch (made.kind) {
        case PipelineOutcome::Kind::kSignature:
            return commit(running, (*collection)->collection.generation, std::move(made));
        case PipelineOutcome::Kind::kCancelled: return cancelled(running);
        case PipelineOutcome::Kind::kScanFailed: break;
        case PipelineOutcome::Kind::kStoreFailed:
            log_->error("cannot read the points of a job", fieldsOf(job, made.why));
            return Outcome::kStoreFailed;
    }
    return giveUp(job, made.why);
}

WorkerPool::Outcome WorkerPool::cancelled(const Running& running) {
    if (!running.superseded) return Outcome::kPutBack;
    return giveUp(running.job, {ErrorCode::kCancelled, "its points were deleted or replaced"});
}

WorkerPool::Outcome WorkerPool::commit(const Running& running, std::int64_t generation,
                                       PipelineOutcome made) {
    const store::Job& job = running.job;
    const double seconds = made.seconds;
    const store::SignatureRow row = rowOf(std::move(made), job.shapeId, job.pointsVersion, generation);
    Result<std::optional<store::Shape>> finished = std::optional<store::Shape>();
    const bool current =
        index_.whileGeneration(job.collectionId, generation, [&] { finished = store_.finishJob(job, row); });
    if (!current) {
        // A rebuild has switched the parameters: again, with the new ones. Or the index could not be
        // read, and then there is no hurry.
        const auto now = index_.byId(job.collectionId);
        const bool unchanged = now && (*now)->collection.generation == generation;
        return unchanged ? Outcome::kStoreFailed : Outcome::kPutBack;
    }
    if (!finished) {
        log_->error("cannot store a signature", fieldsOf(job, finished.error()));
        return isTransient(finished.error().code) ? Outcome::kStoreFailed : giveUp(job, finished.error());
    }
    if (!*finished) return Outcome::kDone;  // deleted or replaced meanwhile
    SHAPEDB_FAILPOINT("worker.stored");
    ingested_.fetch_add(1);
    if (const auto refreshed = index_.refresh(job.collectionId, job.shapeId); !refreshed) {
        log_->error("signature is stored but not searched yet", fieldsOf(job, refreshed.error()));
    }
    log_->debug("segmented", {{"shape", job.shapeId},
                              {"key", (*finished)->key},
                              {"points", (*finished)->pointCount},
                              {"seconds", seconds}});
    return Outcome::kDone;
}

WorkerPool::Outcome WorkerPool::giveUp(const store::Job& job, const Error& why) {
    const auto failed = store_.failJob(job, why);
    if (!failed) {
        log_->error("cannot record that a scan failed", fieldsOf(job, failed.error()));
        if (failed.error().code == ErrorCode::kDataLoss) {
            const std::lock_guard<std::mutex> lock(mutex_);
            takeOutOfService(failed.error());
        }
        return Outcome::kStoreFailed;
    }
    if (!*failed) return Outcome::kDone;  // deleted or replaced meanwhile
    SHAPEDB_FAILPOINT("worker.failed");
    auto fields = fieldsOf(job, why);
    fields.push_back({"key", (*failed)->key});
    log_->warn("scan cannot be segmented", fields);
    stopSearching(**failed);
    return Outcome::kDone;
}

/// A signature of older points no longer serves.
void WorkerPool::stopSearching(const store::Shape& failed) {
    const auto refreshed = index_.refresh(failed.collectionId, failed.id);
    if (refreshed) return;
    auto fields = telemetry::fieldsOf(refreshed.error());
    fields.push_back({"shape", failed.id});
    log_->error("a failed scan still appears in searches", fields);
}

void WorkerPool::putBack(const store::Job& job) {
    const auto released = store_.releaseJob(job);
    if (released || released.error().code == ErrorCode::kNotFound) return;  // gone with its shape
    log_->error("cannot put a job back", fieldsOf(job, released.error()));
    const std::lock_guard<std::mutex> lock(mutex_);
    unreleased_.push_back(job);
}

}  // namespace shapedb::ingest
