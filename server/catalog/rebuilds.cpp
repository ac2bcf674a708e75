// SPDX-License-Identifier: GPL-3.0-or-later
// Rebuilds: begin, follow, cancel.
#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/catalog/call_frame.h"
#include "server/catalog/catalog.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {
namespace {

RebuildProgress progressOf(const std::string& collection, const store::Rebuild& rebuild) {
    using namespace std::chrono;
    const store::TimestampMs now =
        duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
    const store::TimestampMs end = rebuild.finishedAt != 0 ? rebuild.finishedAt : now;
    RebuildProgress progress;
    progress.collection = collection;
    progress.done = rebuild.done;
    progress.total = rebuild.total;
    progress.failed = rebuild.failed;
    progress.finished = rebuild.state == store::RebuildState::kDone;
    // Never negative, though the clock may have been set back.
    progress.seconds =
        static_cast<double>(std::max<store::TimestampMs>(0, end - rebuild.startedAt)) / 1'000.0;
    return progress;
}

}  // namespace

Result<void> Catalog::rebuild(const RebuildRequest& request, CallFrame& frame,
                              const OnRebuildProgress& onProgress) {
    const auto names = rebuildTargets(request);
    RETURN_IF_ERROR(names);
    if (request.cacheOnly) return reloadAll(*names, onProgress);

    RETURN_IF_ERROR(frame.becomeFollower());
    const auto begun = beginRebuilds(*names, request.change);
    RETURN_IF_ERROR(begun);
    for (std::size_t i = 0; i < begun->size(); ++i) {
        const std::string& name = (*names)[i];
        const store::Rebuild& first = (*begun)[i];
        const auto tell = [&](const store::Rebuild& now) { return onProgress(progressOf(name, now)); };
        RETURN_IF_ERROR(request.detached ? tell(first)
                                         : followRebuild(
                                               name, first, frame.run(),
                                               [&] { return frame.checkpointWhileFollowing(); }, tell));
    }
    return {};
}

Result<void> Catalog::reloadAll(const std::vector<std::string>& names, const OnRebuildProgress& onProgress) {
    for (const std::string& name : names) {
        const auto began = std::chrono::steady_clock::now();
        const auto reloaded = reload(name);
        RETURN_IF_ERROR(reloaded);
        RebuildProgress progress;
        progress.collection = name;
        progress.done = progress.total = (*reloaded)->signatures.size();
        progress.finished = true;
        progress.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
        RETURN_IF_ERROR(onProgress(progress));
    }
    return {};
}

Result<std::vector<std::string>> Catalog::rebuildTargets(const RebuildRequest& request) const {
    if (request.change && (request.cacheOnly || request.collection.empty())) {
        return fail(ErrorCode::kInvalidArgument,
                    request.cacheOnly ? "parameters cannot change with cache_only: leave one out"
                                      : "collection: name the collection that gets the new parameters");
    }
    std::vector<std::string> names;
    if (!request.collection.empty()) {
        const auto found = collection(request.collection);
        RETURN_IF_ERROR(found);
        names.push_back((*found)->collection.name);
        return names;
    }
    const auto all = collections();
    RETURN_IF_ERROR(all);
    for (const index::SnapshotPtr& snapshot : *all) names.push_back(snapshot->collection.name);
    return names;
}

Result<std::vector<store::Rebuild>> Catalog::beginRebuilds(const std::vector<std::string>& names,
                                                           const std::optional<ParameterOverrides>& change) {
    const RestoreGate::Write write(restores_);
    std::vector<store::Rebuild> begun;
    for (const std::string& name : names) {
        // Looked up under the gate: a restore may have replaced the collection and its parameters.
        const auto found = collection(name);
        RETURN_IF_ERROR(found);
        Result<ShapeParameters> parameters = (*found)->parameters;
        // With a profile, all of them are new: the way out when those there were are damaged.
        if (!change || !change->profile) RETURN_IF_ERROR((*found)->requireParameters());
        if (change) parameters = change->applyTo(*parameters);
        RETURN_IF_ERROR(parameters);
        RETURN_IF_ERROR(validate(*parameters));
        auto rebuild = rebuilds_.begin((*found)->collection, *parameters);
        RETURN_IF_ERROR(rebuild);
        begun.push_back(std::move(*rebuild));
    }
    return begun;
}

Result<void> Catalog::cancelRebuild(const std::string& name) {
    const RestoreGate::Write write(restores_);
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    return rebuilds_.cancel((*found)->collection);
}

Result<void> Catalog::followRebuild(const std::string& collection, store::Rebuild rebuild,
                                    const RunContext& context, const Checkpoint& checkpoint,
                                    const std::function<Result<void>(const store::Rebuild&)>& onChange) {
    RunContext briefly = context;
    for (;;) {
        RETURN_IF_ERROR(onChange(rebuild));
        switch (rebuild.state) {
            case store::RebuildState::kRunning: break;
            case store::RebuildState::kDone: return {};
            case store::RebuildState::kCancelled:
                return fail(ErrorCode::kCancelled,
                            "the rebuild of collection '" + collection + "' was cancelled");
            case store::RebuildState::kFailed:
                return fail(ErrorCode::kInternal,
                            "the rebuild of collection '" + collection + "' failed: see the log");
        }
        for (bool waiting = true; waiting;) {
            RETURN_IF_ERROR(checkpoint());
            // In short pieces, to check in between whether the caller still waits.
            briefly.deadline = std::min(context.deadline, RunContext::Clock::now() + kProgressInterval);
            const auto changed = rebuilds_.waitForChange(rebuild, briefly);
            if (changed) {
                rebuild = *changed;
                waiting = false;
            } else if (changed.error().code != ErrorCode::kDeadlineExceeded) {
                return fail(changed.error());
            }
        }
    }
}

}  // namespace shapedb::catalog
