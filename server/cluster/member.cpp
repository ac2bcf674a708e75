// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/member.h"

#include <algorithm>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/cluster/holder.h"

namespace shapedb::cluster {

namespace {

/// Between two looks at the logs of changes, when nothing asks for one sooner.
constexpr std::chrono::milliseconds kPause{100};
/// How long a request waits for changes that are not known yet.
constexpr std::chrono::milliseconds kPatience{1'000};
/// Rows, and changes, that are read together.
constexpr std::size_t kPageRows = 4'096;
/// The same is not told again before.
constexpr std::chrono::minutes kBetweenWarnings{1};
/// A lease is renewed this often in its length.
constexpr int kBeatsOfTerm = 3;

}  // namespace

Member::Member(Parts parts, KeeperOptions options)
    : parts_(std::move(parts)),
      name_(options.server),
      term_(options.term),
      keeper_(std::move(options)),
      routes_(std::make_shared<const Routes>()) {}

Instant Member::now() {
    return std::chrono::duration_cast<Instant>(std::chrono::steady_clock::now().time_since_epoch());
}

// Leases -------------------------------------------------------------------------------------

Result<void> Member::start() {
    RETURN_IF_ERROR(beatOnce());
    beats_ = std::thread([this] { beatLoop(); });
    follows_ = std::thread([this] { followLoop(); });
    return {};
}

Result<void> Member::beatOnce() {
    const std::lock_guard<std::mutex> alone(beating_);
    Beat beat;
    const Instant sentAt = now();
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        beat = keeper_.next(sentAt);
    }
    const auto view = parts_.leases->beat(beat);
    RETURN_IF_ERROR(view);
    const std::lock_guard<std::mutex> lock(mutex_);
    keeper_.onView(sentAt, *view);
    routes_ = routesOf(*view);
    viewedAt_ = sentAt;
    if (view->resized && view->servers.size() > 1 && now() >= nextWarning_) {
        parts_.log->warn(
            "another server of this database has another cluster.replicas: shards have fewer holders than "
            "they should until all have the same");
        nextWarning_ = now() + kBetweenWarnings;
    }
    wake_ = true;  // it may want other shards
    ++news_;
    changed_.notify_all();
    return {};
}

void Member::beatLoop() {
    bool working = true;
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stop_) {
        changed_.wait_for(lock, term_ / kBeatsOfTerm, [this] { return stop_ || beatSoon_; });
        if (stop_) return;
        beatSoon_ = false;
        lock.unlock();
        const auto beaten = beatOnce();
        // Told once for each time that it stops working.
        if (!beaten && working) {
            parts_.log->error("the leases of shards cannot be renewed: other servers may take them",
                              telemetry::fieldsOf(beaten.error()));
        }
        if (beaten && !working) parts_.log->info("the leases of shards are renewed again");
        working = beaten.has_value();
        lock.lock();
    }
}

void Member::leave() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        keeper_.leave();
    }
    const Instant until = now() + term_;
    while (now() < until) {
        if (!beatOnce()) return;
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            if (keeper_.held(now()).none() || routes_->servers.size() < 2) return;
        }
        std::this_thread::sleep_for(kPause);
    }
}

void Member::stop() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    if (beats_.joinable()) beats_.join();
    if (follows_.joinable()) follows_.join();
}

RoutesPtr Member::routes() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return routes_;
}

Result<RoutesPtr> Member::readRoutes() {
    const auto view = parts_.leases->view();
    RETURN_IF_ERROR(view);
    auto routes = routesOf(*view);
    const std::lock_guard<std::mutex> lock(mutex_);
    routes_ = routes;
    return routes;
}

// Contents -----------------------------------------------------------------------------------

void Member::followLoop() {
    bool first = true;
    while (true) {
        ShardSet wanted;
        {
            std::unique_lock<std::mutex> lock(mutex_);
            if (stop_) return;
            wake_ = false;
            wanted = keeper_.wanted(now());
        }
        const bool more = followOnce(wanted, first);
        first = false;
        if (more) continue;
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait_for(lock, kPause, [this] { return stop_ || wake_; });
    }
}

bool Member::followOnce(const ShardSet& wanted, bool first) {
    const std::vector<std::int64_t> ids = parts_.collections();
    for (const std::int64_t id : ids) {
        Following& one = replicas_[id];
        if (one.replica) continue;
        one.content = std::make_shared<ShardContent>(parts_.onChanged, parts_.log);
        one.replica = std::make_unique<Replica>(*parts_.source, *one.content, id, kPageRows);
        // One that came later is loaded while the others go on.
        one.counts = first;
    }
    for (auto one = replicas_.begin(); one != replicas_.end();) {
        const bool isThere = std::find(ids.begin(), ids.end(), one->first) != ids.end();
        one = isThere ? std::next(one) : replicas_.erase(one);
    }
    bool more = false;
    bool followed = true;
    ShardSet loaded = wanted;
    for (auto& [id, one] : replicas_) {
        one.replica->setWanted(wanted);
        const auto step = one.replica->step();
        more |= step && *step;
        // One that is gone will be off the list soon.
        if (!step && step.error().code != ErrorCode::kNotFound) {
            if (following_) {
                parts_.log->error("changes cannot be read: searches of this server's shards wait for them",
                                  telemetry::fieldsOf(step.error()));
            }
            followed = false;
        }
        one.counts |= (wanted & ~one.replica->complete()).none();
        if (one.counts) loaded &= one.replica->complete();
    }
    noteProgress(loaded, followed);
    return more;
}

void Member::noteProgress(const ShardSet& loaded, bool followed) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (followed && !following_) parts_.log->info("changes are read again");
    following_ = followed;
    beatSoon_ |= (loaded & ~loaded_).any();
    loaded_ = loaded;
    keeper_.setLoaded(loaded);
    contents_.clear();
    for (const auto& [id, one] : replicas_) contents_.emplace(id, one.content);
    ++news_;
    changed_.notify_all();
}

/// Under the lock: some of its leases may have come since the last beat.
bool Member::isNews(const Ask& ask) const {
    return std::any_of(ask.shards.begin(), ask.shards.end(),
                       [&](const auto& one) { return keeper_.isNews(one.first, one.second); });
}

Result<ShownPtr> Member::content(std::int64_t collectionId, const Ask& ask, const RunContext& context) {
    const auto until = std::min(context.deadline, RunContext::Clock::now() + kPatience);
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
        const auto found = contents_.find(collectionId);
        const ShownPtr shown = found == contents_.end() ? nullptr : found->second->shown();
        auto answer = Answerable::kBehind;  // a collection that it will hear of
        if (shown) answer = answerable(ask, shown->content, keeper_, now());
        if (answer == Answerable::kYes) return shown;
        RETURN_IF_ERROR(context.checkpoint());
        const bool over = stop_ || RunContext::Clock::now() >= until;
        if (answer == Answerable::kNo && (over || !isNews(ask))) {
            return fail(ErrorCode::kUnavailable,
                        "this server does not hold all shards that it was asked for");
        }
        if (over) {
            return fail(ErrorCode::kNotReady, "this server does not know the latest changes yet");
        }
        (answer == Answerable::kNo ? beatSoon_ : wake_) = true;
        changed_.notify_all();
        changed_.wait_for(lock, kPause, [this, news = news_] { return stop_ || news_ != news; });
    }
}

Member::State Member::state() const {
    State state;
    const std::lock_guard<std::mutex> lock(mutex_);
    state.held = keeper_.held(now()).count();
    state.wanted = keeper_.wanted(now()).count();
    for (const auto& holders : routes_->holders) state.uncovered += holders.empty() ? 1 : 0;
    state.following = following_;
    state.current = now() - viewedAt_ < term_;
    for (const auto& [id, content] : contents_) {
        const ShownPtr shown = content->shown();
        if (!shown) continue;
        for (const SignatureSet& shard : shown->shards) {
            state.signatures += shard.size();
            state.bytes += shard.memoryBytes();
        }
    }
    return state;
}

}  // namespace shapedb::cluster
