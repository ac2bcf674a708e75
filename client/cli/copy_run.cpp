// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/copy_run.h"

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>
#include <utility>

#include "client/cli/failures.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// Shapes per request, and differences that are gathered before they are taken over.
constexpr std::size_t kCopyBatch = 1000;
/// By how much the clocks of servers may differ, and a change may take to be committed.
constexpr std::chrono::seconds kLateness{60};

/// The servers are busy or have just changed: the next pass may succeed.
bool passesBy(const Error& error) {
    switch (error.code) {
        case ErrorCode::kNotFound:
        case ErrorCode::kVersionConflict:
        case ErrorCode::kQueueFull:
        case ErrorCode::kRateLimited:
        case ErrorCode::kNotReady: return true;
        default: return false;
    }
}

/// The change that leaves a shape exactly the metadata `wanted`.
client::MetadataChange changeBetween(const client::Metadata& has, const client::Metadata& wanted) {
    client::MetadataChange change;
    for (const auto& [name, value] : wanted) {
        const auto found = has.find(name);
        if (found == has.end() || found->second != value) change.set[name] = value;
    }
    for (const auto& [name, value] : has) {
        if (wanted.count(name) == 0) change.remove.push_back(name);
    }
    return change;
}

}  // namespace

CopyCounts& CopyCounts::operator+=(const CopyCounts& more) {
    added += more.added;
    replaced += more.replaced;
    metadataChanged += more.metadataChanged;
    deleted += more.deleted;
    collections += more.collections;
    return *this;
}

CopyRun::CopyRun(const CopySides& sides, unsigned jobs, const RunContext& context, Progress progress)
    : sides_(sides), jobs_(std::max(1u, jobs)), context_(context), progress_(std::move(progress)) {}

Result<CopyPass> CopyRun::pass(bool whole) {
    CopyPass pass;
    pass.whole = whole;
    pass.clean = true;
    const auto from = sides_.from.listCollections(context_);
    RETURN_IF_ERROR(from);
    const auto to = sides_.to.listCollections(context_);
    RETURN_IF_ERROR(to);
    RETURN_IF_ERROR(alignCollections(*from, *to, pass));
    for (const client::Collection& one : *from) {
        if (lacks(one)) continue;
        const auto aligned = alignShapes(one.name, whole, pass);
        if (aligned) continue;
        if (!passesBy(aligned.error())) return fail(aligned.error());
        pass.clean = false;
        uneven_.insert(one.name);
    }
    RETURN_IF_ERROR(compareCounts(*from, pass));
    return pass;
}

Result<void> CopyRun::alignCollections(const std::vector<client::Collection>& from,
                                       const std::vector<client::Collection>& to, CopyPass& pass) {
    for (const CollectionStep& step : stepsBetween(from, to, madeOf_)) {
        if (wasRefused(step)) continue;
        pass.clean = false;
        const Result<void> taken = take(step);
        if (!taken && endsTheCommand(taken.error())) return taken;
        const Place place{stepText(step), {}};
        if (!taken && !passesBy(taken.error())) {
            refused_[place].version = step.collection.generation;
            pass.refused.push_back({place.first, taken.error()});
        }
        if (!taken) continue;
        refused_.erase(place);
        // One that is running is begun once, however often it is asked for.
        const bool rebuild = step.kind == CollectionStep::Kind::kRebuild;
        const bool going = rebuild && rebuilding_.count(step.name) != 0 &&
                           rebuilding_[step.name] == step.collection.generation;
        if (rebuild) rebuilding_[step.name] = step.collection.generation;
        if (!going) ++pass.counts.collections;
    }
    return {};
}

Result<void> CopyRun::take(const CollectionStep& step) {
    const client::Client& to = sides_.to;
    const auto without = [](const auto& done) { return done ? Result<void>() : fail(done.error()); };
    switch (step.kind) {
        case CollectionStep::Kind::kDeleteAlias: return to.deleteAlias(step.name, context_);
        case CollectionStep::Kind::kRename: {
            const auto renamed = to.renameCollection(step.name, step.other, context_);
            const auto made = madeOf_.find(step.name);
            if (renamed && made != madeOf_.end()) madeOf_[step.other] = made->second;
            return without(renamed);
        }
        case CollectionStep::Kind::kDelete:
            madeOf_.erase(step.name);
            return to.deleteCollection(step.name, true, context_);
        case CollectionStep::Kind::kCreate: {
            const client::Collection& made = step.collection;
            const auto created = to.createCollection(made.name, made.description, made.parameters, context_);
            if (created) madeOf_[made.name] = made.created;
            uneven_.insert(made.name);
            return without(created);
        }
        case CollectionStep::Kind::kRebuild: {
            client::RebuildRequest request;
            request.collection = step.name;
            request.parameters = step.collection.parameters;
            request.detach = true;
            const auto begun = to.rebuild(request, {}, context_);
            // One with other parameters is running: those of before.
            if (!begun && begun.error().code == ErrorCode::kRejected) {
                return to.cancelRebuild(step.name, context_);
            }
            return without(begun);
        }
        case CollectionStep::Kind::kSetAlias: return without(to.setAlias(step.name, step.other, context_));
    }
    return {};
}

Result<void> CopyRun::alignShapes(const std::string& collection, bool whole, CopyPass& pass) {
    if (!whole && uneven_.count(collection) == 0 && newest_.count(collection) != 0) {
        return compareRecent(collection, pass);
    }
    uneven_.erase(collection);
    return compareAll(collection, pass);
}

Result<void> CopyRun::compareAll(const std::string& collection, CopyPass& pass) {
    // What differs no longer is refused no longer.
    std::set<Place> forgotten;
    for (const auto& [place, refused] : refused_) {
        if (place.first == collection && !place.second.empty()) forgotten.insert(place);
    }
    client::Timestamp newest{};
    std::uint64_t compared = 0;
    std::vector<ShapePair> differing;
    const auto visited = visitPairs(
        sides_, collection,
        [&](ShapePair&& pair) -> Result<void> {
            if (pair.from) newest = std::max(newest, pair.from->updated);
            progress_("compare " + collection, ++compared, 0);
            const ShapeDifference difference = differenceOf(pair);
            if (difference == ShapeDifference::kNone || difference == ShapeDifference::kState) return {};
            forgotten.erase({collection, pair.key()});
            differing.push_back(std::move(pair));
            return differing.size() < kCopyBatch ? Result<void>() : apply(collection, differing, pass);
        },
        context_);
    RETURN_IF_ERROR(visited);
    RETURN_IF_ERROR(apply(collection, differing, pass));
    for (const Place& place : forgotten) refused_.erase(place);
    newest_[collection] = newest;
    return {};
}

Result<void> CopyRun::compareRecent(const std::string& collection, CopyPass& pass) {
    client::ListRequest request;
    request.collection = collection;
    request.order = client::ShapeOrder::kUpdated;
    request.descending = true;
    request.pageSize = kCopyBatch;
    const client::Timestamp oldest = newest_[collection] - kLateness;
    client::Timestamp newest = newest_[collection];
    // Goes on beyond `oldest` while there is news: a clock may have been set.
    for (bool more = true; more;) {
        auto page = sides_.from.listShapes(request, context_);
        RETURN_IF_ERROR(page);
        request.cursor = page->nextCursor;
        if (page->shapes.empty()) break;
        newest = std::max(newest, page->shapes.front().updated);
        const bool reached = page->shapes.back().updated < oldest;
        auto pairs = pairsOf(sides_, collection, std::move(page->shapes), context_);
        RETURN_IF_ERROR(pairs);
        const std::uint64_t before = pass.counts.all();
        RETURN_IF_ERROR(apply(collection, *pairs, pass));
        more = !request.cursor.empty() && (!reached || pass.counts.all() != before);
    }
    newest_[collection] = newest;
    return {};
}

Result<void> CopyRun::compareCounts(const std::vector<client::Collection>& before, CopyPass& pass) {
    const auto from = sides_.from.listCollections(context_);
    RETURN_IF_ERROR(from);
    const auto to = sides_.to.listCollections(context_);
    RETURN_IF_ERROR(to);
    std::map<std::string, std::uint64_t> had;
    std::map<std::string, std::uint64_t> there;
    for (const client::Collection& one : before) had[one.name] = one.shapes;
    for (const client::Collection& one : *to) there[one.name] = one.shapes;
    if (from->size() != before.size()) pass.clean = false;
    for (const CollectionStep& step : stepsBetween(*from, *to, madeOf_)) {
        if (!wasRefused(step)) pass.clean = false;
    }
    std::map<std::string, std::uint64_t> missing;
    for (const auto& [place, refused] : refused_) missing[place.first] += refused.missing ? 1 : 0;
    for (const client::Collection& one : *from) {
        if (lacks(one)) continue;
        const std::uint64_t copied = there[one.name] + missing[one.name];
        if (copied != one.shapes || had[one.name] != one.shapes) pass.clean = false;
        // Between the two the number may be right, whatever was written meanwhile.
        const auto [least, most] = std::minmax(had[one.name], one.shapes);
        if (copied < least || copied > most) uneven_.insert(one.name);
    }
    return {};
}

Result<void> CopyRun::apply(const std::string& collection, std::vector<ShapePair>& pairs, CopyPass& pass) {
    std::atomic<std::size_t> next{0};
    std::atomic<std::size_t> finished{0};
    std::optional<Error> stop;
    const auto work = [&] {
        for (std::size_t i = next++; i < pairs.size(); i = next++) {
            const ShapePair& pair = pairs[i];
            const ShapeDifference difference = differenceOf(pair);
            ++finished;
            if (difference == ShapeDifference::kNone || difference == ShapeDifference::kState) continue;
            if (wasRefused(collection, pair)) continue;
            const Result<bool> done = apply(collection, pair, difference);
            const std::lock_guard<std::mutex> lock(mutex_);
            note(collection, pair, difference, done, pass);
            if (!done && endsTheCommand(done.error())) stop = done.error();
            if (stop) return;
            progress_("copy " + collection, finished, pairs.size());
        }
    };
    std::vector<std::thread> workers;
    for (std::size_t i = 1; i < std::min<std::size_t>(jobs_, pairs.size()); ++i) workers.emplace_back(work);
    work();
    for (std::thread& worker : workers) worker.join();
    pairs.clear();
    return stop ? Result<void>(fail(*stop)) : Result<void>();
}

Result<bool> CopyRun::apply(const std::string& collection, const ShapePair& pair,
                            ShapeDifference difference) {
    RunContext context = context_;
    context.progress = nullptr;  // progress counts shapes
    const client::ShapeRef ref{collection, pair.key()};
    const auto gone = [](const auto& done) { return !done && done.error().code == ErrorCode::kNotFound; };
    if (difference == ShapeDifference::kMetadata) {
        const auto changed = sides_.to.updateMetadata(
            ref, changeBetween(pair.to->metadata, pair.from->metadata), std::nullopt, context);
        RETURN_IF_ERROR(changed);
        return true;
    }
    if (difference == ShapeDifference::kExtra) {
        const auto here = sides_.from.getShape(ref, context);
        if (here) return false;
        if (!gone(here)) return fail(here.error());
        const auto deleted = sides_.to.deleteShape(ref, std::nullopt, context);
        if (gone(deleted)) return false;
        RETURN_IF_ERROR(deleted);
        return true;
    }
    const auto copied = sides_.from.copyShape(ref, sides_.to, ref, context);
    if (gone(copied)) return false;
    RETURN_IF_ERROR(copied);
    return true;
}

bool CopyRun::wasRefused(const std::string& collection, const ShapePair& pair) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = refused_.find({collection, pair.key()});
    return known != refused_.end() && known->second.version == (pair.from ? pair.from->version : 0);
}

bool CopyRun::wasRefused(const CollectionStep& step) const {
    const auto known = refused_.find({stepText(step), {}});
    return known != refused_.end() && known->second.version == step.collection.generation;
}

bool CopyRun::lacks(const client::Collection& collection) const {
    return wasRefused({CollectionStep::Kind::kCreate, collection.name, {}, collection});
}

void CopyRun::note(const std::string& collection, const ShapePair& pair, ShapeDifference difference,
                   const Result<bool>& done, CopyPass& pass) {
    pass.clean = false;
    const Place place{collection, pair.key()};
    if (!done) {
        if (endsTheCommand(done.error()) || passesBy(done.error())) return;
        const std::int64_t version = pair.from ? pair.from->version : 0;
        refused_[place] = {version, difference == ShapeDifference::kMissing};
        pass.refused.push_back({collection + "/" + pair.key(), done.error()});
        return;
    }
    refused_.erase(place);
    if (!*done) return;
    switch (difference) {
        case ShapeDifference::kMissing: ++pass.counts.added; break;
        case ShapeDifference::kPoints: ++pass.counts.replaced; break;
        case ShapeDifference::kMetadata: ++pass.counts.metadataChanged; break;
        case ShapeDifference::kExtra: ++pass.counts.deleted; break;
        case ShapeDifference::kNone:
        case ShapeDifference::kState: break;
    }
}

}  // namespace shapedb::cli
