// SPDX-License-Identifier: GPL-3.0-or-later
// Start and stop, collections, backup and restore; shapes.cpp has the shapes, rebuilds.cpp the rebuilds,
// transfer.cpp exports and imports.
#include "server/catalog/catalog.h"

#include <algorithm>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/catalog/file_name.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"
#include "server/store/parameters_codec.h"

namespace shapedb::catalog {

namespace {

/// Requests that name no collection mean this one.
Result<void> ensureDefaultCollection(store::Store& store) {
    const auto created =
        store.createCollection(kDefaultCollection, "Used by requests that name no collection.",
                               store::encodeParameters(parametersOf(Profile::kDefault)));
    if (!created && created.error().code != ErrorCode::kAlreadyExists) return fail(created.error());
    return {};
}

}  // namespace

Catalog::Catalog(std::unique_ptr<store::Store> store, ingest::SignaturePipeline pipeline,
                 telemetry::LoggerPtr log, CatalogOptions options)
    : log_(std::move(log)),
      options_(std::move(options)),
      store_(std::move(store)),
      pipeline_(std::move(pipeline)),
      index_(*store_, log_, options_.signatures),
      workers_(*store_, index_, board_, isolation_, pipeline_, log_, options_.workers),
      rebuilds_(*store_, index_, workers_, isolation_, pipeline_, log_, options_.rebuilds),
      slots_(options_.segmentations),
      follower_({*store_, index_, restores_, directory_, [this] { workers_.wake(); },
                 [this](std::int64_t id) { workers_.supersedeCollection(id); }, log_}) {}

Catalog::~Catalog() = default;

Result<void> Catalog::start() {
    // First, so that the index loads it with the others. If its state cannot be read, it is left as it is.
    if (const auto ensured = ensureDefaultCollection(*store_); !ensured) {
        if (ensured.error().code != ErrorCode::kDataLoss) return ensured;
        log_->error("cannot tell whether the default collection is there",
                    telemetry::fieldsOf(ensured.error()));
    }
    const auto began = std::chrono::steady_clock::now();
    const std::vector<std::string> known = store_->findings();
    RETURN_IF_ERROR(follower_.begin());
    RETURN_IF_ERROR(index_.loadAll());
    for (const std::string& finding : store_->findings()) {
        if (std::find(known.begin(), known.end(), finding) == known.end()) log_->error(finding);
    }
    const auto totals = index_.totals();
    log_->info(
        "index loaded",
        {{"signatures", totals.signatures},
         {"bytes", totals.bytes},
         {"seconds", std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count()}});
    if (options_.segments) RETURN_IF_ERROR(workers_.start());
    if (store_->isShared()) follower_.start();
    return options_.segments ? rebuilds_.start() : Result<void>();
}

Result<void> Catalog::stop() {
    follower_.stop();
    rebuilds_.stop();
    workers_.stop();
    return store_->checkpoint();
}

// Collections ----------------------------------------------------------------------------

Result<index::SnapshotPtr> Catalog::collection(const std::string& name) const {
    RETURN_IF_ERROR(requireContent());
    return index_.byName(collectionNameOrDefault(name));
}

std::string Catalog::nameOf(const std::string& name) const {
    std::string own = collectionNameOrDefault(name);
    const auto found = index_.byName(own);
    return found ? (*found)->collection.name : own;
}

Result<std::vector<index::SnapshotPtr>> Catalog::collections() const {
    RETURN_IF_ERROR(requireContent());
    return index_.all();
}

Result<void> Catalog::requireContent() const {
    if (!restores_.apart()) return {};
    RETURN_IF_ERROR(restores_.requireNoRestore());
    return fail(ErrorCode::kUnavailable,
                "the content of a backup could not be loaded: restart the server or restore again");
}

Result<ShapeCounts> Catalog::countShapes(const index::Snapshot& collection) {
    const auto count = [&](std::optional<store::ShapeState> state) {
        return store_->countShapes(collection.collection.id, {state, nullptr});
    };
    const auto all = count(std::nullopt);
    RETURN_IF_ERROR(all);
    const auto ready = count(store::ShapeState::kReady);
    RETURN_IF_ERROR(ready);
    const auto failed = count(store::ShapeState::kFailed);
    RETURN_IF_ERROR(failed);
    return ShapeCounts{*all, *ready, *failed};
}

Result<index::SnapshotPtr> Catalog::createCollection(const std::string& name, const std::string& description,
                                                     const ShapeParameters& parameters) {
    RETURN_IF_ERROR(checkCollectionName(name));
    RETURN_IF_ERROR(checkDescription(description));
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireContent());
    const std::lock_guard<std::mutex> lock(directory_);
    const auto created = store_->createCollection(name, description, store::encodeParameters(parameters));
    RETURN_IF_ERROR(created);
    return index_.add(*created);
}

Result<void> Catalog::deleteCollection(const std::string& name, bool force) {
    RETURN_IF_ERROR(checkCollectionName(name));
    const RestoreGate::Write write(restores_);
    const auto found = collectionNamed(name);
    RETURN_IF_ERROR(found);
    const store::Collection& collection = (*found)->collection;
    if (!force) {
        const auto shapes = store_->countShapes(collection.id, {});
        RETURN_IF_ERROR(shapes);
        if (*shapes > 0) {
            return fail(ErrorCode::kRejected, "collection '" + collection.name + "' holds " +
                                                  std::to_string(*shapes) +
                                                  " shapes, which would be deleted with it");
        }
    }
    const auto cancelled = rebuilds_.cancel(collection);
    // On a full disk its results go with the collection.
    const auto mayGoOn = [](ErrorCode code) {
        return code == ErrorCode::kNotFound || code == ErrorCode::kStorageFull;
    };
    if (!cancelled && !mayGoOn(cancelled.error().code)) return cancelled;
    const std::lock_guard<std::mutex> lock(directory_);
    // The store first, which may refuse; the index and the workers follow.
    bool gone = false;
    const auto deleted = store_->deleteCollection(collection.id, [&] {
        gone = true;
        index_.remove(collection.id);
        workers_.supersedeCollection(collection.id);
    });
    if (deleted || !gone) return deleted;
    log_->error(
        "the space of a deleted collection is not freed yet: the next deletion or the next start continues",
        telemetry::fieldsOf(deleted.error()));
    return {};
}

Result<index::SnapshotPtr> Catalog::collectionNamed(const std::string& name) const {
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    const std::string& own = (*found)->collection.name;
    if (own == name) return found;
    return fail(ErrorCode::kNotFound,
                "'" + name + "' is an alias: name the collection itself, '" + own + "'");
}

Result<index::SnapshotPtr> Catalog::renameCollection(const std::string& name, const std::string& newName) {
    RETURN_IF_ERROR(checkCollectionName(name));
    if (const auto checked = checkCollectionName(newName); !checked) {
        return fail(withContext(checked.error(), "new_"));
    }
    if (name == kDefaultCollection) {
        return fail(ErrorCode::kRejected, std::string("collection '") + kDefaultCollection +
                                              "' keeps its name: requests that name no collection mean it");
    }
    const RestoreGate::Write write(restores_);
    const auto found = collectionNamed(name);
    RETURN_IF_ERROR(found);
    const std::int64_t id = (*found)->collection.id;
    const std::lock_guard<std::mutex> lock(directory_);
    return index_.rename(id, [&] { return store_->renameCollection(id, newName); });
}

Result<index::SnapshotPtr> Catalog::setAlias(const std::string& alias, const std::string& name) {
    if (const auto checked = checkCollectionName(alias); !checked) {
        return fail(withContext(checked.error(), "alias: "));
    }
    RETURN_IF_ERROR(checkCollectionName(name));
    const RestoreGate::Write write(restores_);
    // One after the other, so that store and index end with the same.
    const std::lock_guard<std::mutex> lock(directory_);
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    RETURN_IF_ERROR(store_->setAlias(alias, (*found)->collection.id));
    index_.setAlias(alias, (*found)->collection.id);
    return found;
}

Result<void> Catalog::deleteAlias(const std::string& alias) {
    if (const auto checked = checkCollectionName(alias); !checked) {
        return fail(withContext(checked.error(), "alias: "));
    }
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireContent());
    const std::lock_guard<std::mutex> lock(directory_);
    RETURN_IF_ERROR(store_->deleteAlias(alias));
    index_.removeAlias(alias);
    return {};
}

Result<index::SnapshotPtr> Catalog::reload(const std::string& name) {
    const RestoreGate::Write write(restores_);
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    const std::int64_t id = (*found)->collection.id;
    RETURN_IF_ERROR(index_.reload(id));
    return index_.byId(id);
}

// What other servers change ----------------------------------------------------------------

std::int64_t Catalog::changeOf(const store::Shape& shape) {
    const auto at = store_->position(shape.collectionId);
    return at ? at->lastChange : 0;
}

Result<index::SnapshotPtr> Catalog::withChange(const index::SnapshotPtr& collection, std::int64_t atLeast) {
    if (atLeast <= 0 || !store_->isShared()) return collection;
    RETURN_IF_ERROR(follower_.followTo(collection->collection.id, atLeast));
    return index_.byId(collection->collection.id);
}

Result<Catalog::Current> Catalog::current(const index::SnapshotPtr& collection) {
    const std::int64_t id = collection->collection.id;
    const auto at = store_->position(id);
    RETURN_IF_ERROR(at);
    if (at->generation <= collection->collection.generation) return Current{collection, at->lastChange};
    RETURN_IF_ERROR(follower_.follow());
    auto now = index_.byId(id);
    RETURN_IF_ERROR(now);
    return Current{std::move(*now), at->lastChange};
}

std::vector<std::int64_t> Catalog::collectionIds() const {
    std::vector<std::int64_t> ids;
    for (const index::SnapshotPtr& snapshot : index_.all()) ids.push_back(snapshot->collection.id);
    return ids;
}

// The whole database ---------------------------------------------------------------------

Result<void> Catalog::backup(const std::string& path, const RunContext& context) {
    return store_->backup(path, context);
}

Result<std::vector<std::string>> Catalog::check(const RunContext& context) {
    auto problems = store_->check(context);
    RETURN_IF_ERROR(problems);
    // The store does not know what the parameters of a collection mean.
    for (const index::SnapshotPtr& snapshot : index_.all()) {
        if (snapshot->damage) problems->push_back(snapshot->damage->message);
    }
    if (const auto trouble = workers_.trouble()) problems->push_back(trouble->message);
    return problems;
}

Result<void> Catalog::acknowledge() {
    const auto told = store_->acknowledge();
    RETURN_IF_ERROR(told);
    for (const std::string& line : *told) log_->info("acknowledged", {{"notice", line}});
    return {};
}

Result<void> Catalog::restore(const std::string& path, const RunContext& context,
                              const MayReplace& mayReplace) {
    RETURN_IF_ERROR(restores_.beginRestore());
    Result<void> restored = restoreExclusively(path, context, mayReplace);
    restores_.endRestore();
    if (!restored) return fail(named(restored.error(), path, "the file"));
    return restored;
}

Result<void> Catalog::restoreExclusively(const std::string& path, const RunContext& context,
                                         const MayReplace& mayReplace) {
    const auto exclusive = restores_.exclusive();
    rebuilds_.pause();
    workers_.pause();
    bool replaced = false;
    const Result<void> restored = replaceContent(path, context, mayReplace, replaced);
    // Whatever happened: work continues on what the store holds now.
    const auto content = replaced ? ingest::Content::kReplaced : ingest::Content::kSame;
    const auto workers = workers_.resume(content);
    const auto rebuilds = rebuilds_.resume(content);
    RETURN_IF_ERROR(restored);
    return workers ? rebuilds : workers;
}

/// `replaced` tells whether the store holds other content, also after an error.
Result<void> Catalog::replaceContent(const std::string& path, const RunContext& context,
                                     const MayReplace& mayReplace, bool& replaced) {
    Result<void> restored = store_->restore(path, context, [&]() -> Result<void> {
        if (mayReplace) RETURN_IF_ERROR(mayReplace());
        restores_.replacing();
        return {};
    });
    replaced = restored.has_value();
    if (!restored) {
        if (restores_.apart() && !lost_) restores_.replaced();
        return restored;
    }
    // The content of an export has no default collection.
    Result<void> loaded = ensureDefaultCollection(*store_);
    if (loaded) loaded = follower_.begin();
    if (loaded) loaded = index_.loadAll();
    lost_ = !loaded;
    if (loaded) {
        restores_.replaced();
        return {};
    }
    // The old index would pass off its parameters and signatures as those of the new content.
    index_.clear();
    log_->error("the content of a backup cannot be loaded: restart the server or restore again",
                telemetry::fieldsOf(loaded.error()));
    return fail(loaded.error().code, "the backup has replaced the content, but could not be loaded: " +
                                         loaded.error().message + "; restart the server or restore again");
}

Condition Catalog::condition() const {
    return {!restores_.apart() && follower_.isFollowing(), !workers_.trouble(), index_.damaged(), true,
            store_->notices() == 0};
}

Result<CatalogStats> Catalog::stats() {
    const auto stored = store_->stats();
    RETURN_IF_ERROR(stored);
    return withProgress(*stored);
}

Result<CatalogStats> Catalog::recentStats() {
    const auto stored = recentStats_.get();
    RETURN_IF_ERROR(stored);
    return withProgress(*stored);
}

Result<CatalogStats> Catalog::withProgress(const store::StoreStats& stored) {
    const auto depth = store_->queueDepth();
    RETURN_IF_ERROR(depth);
    CatalogStats stats;
    stats.store = stored;
    stats.queue = *depth;
    stats.index = totals_ ? totals_() : index_.totals();
    stats.running = workers_.running();
    // Read one after the other: a job may have begun in between.
    stats.queued = depth->jobs - std::min(depth->jobs, stats.running);
    stats.ingested = workers_.ingested();
    return stats;
}

}  // namespace shapedb::catalog
