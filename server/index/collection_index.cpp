// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/collection_index.h"

#include <algorithm>
#include <exception>
#include <new>
#include <optional>
#include <utility>

#include <oneapi/tbb/parallel_pipeline.h>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "server/index/damaged_collection.h"
#include "server/index/entries.h"
#include "server/store/parameters_codec.h"

namespace shapedb::index {
namespace {

/// Rows of one read, which become a block: enough to be cheap, few enough not to hold up the writer.
constexpr std::size_t kLoadBatch = SignatureSet::kBlockSize;
/// A collection that is read again leaves the other processors to searches.
constexpr std::size_t kBatchesWhileServing = 1;

/// Two per processor: one is decoded while the next is waiting.
std::size_t batchesOfAllProcessors() { return 2 * threadsOfArena(); }

Result<ShapeParameters> parametersOf(const store::Collection& collection) {
    Result<ShapeParameters> parameters = store::decodeParameters(collection.parameters);
    if (!parameters) {
        return fail(parameters.error().code,
                    "collection '" + collection.name + "': " + parameters.error().message);
    }
    return parameters;
}

/// A snapshot to be filled.
Result<std::shared_ptr<Snapshot>> withoutSignatures(const store::Collection& collection) {
    Result<ShapeParameters> parameters = parametersOf(collection);
    RETURN_IF_ERROR(parameters);
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->collection = collection;
    snapshot->parameters = *parameters;
    return snapshot;
}

/// Runs `work`; a failed allocation becomes an error.
template <typename Work>
auto guarded(Work&& work) -> decltype(work()) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the cached signatures");
    }
}

}  // namespace

/// Lock order: gate, apply, then dirty or pointer (never both).
struct CollectionIndex::Slot {
    std::shared_mutex gate;  ///< shared: storing a signature; exclusive: switching generation
    std::mutex apply;        ///< one update at a time
    bool stale = false;      ///< under apply: an update failed, the next one reads everything again
    std::mutex dirtyMutex;
    std::vector<std::int64_t> dirty;  ///< shapes to read again
    std::mutex pointerMutex;
    SnapshotPtr snapshot;

    SnapshotPtr current() {
        const std::lock_guard<std::mutex> lock(pointerMutex);
        return snapshot;
    }
    void publish(SnapshotPtr next) {
        // The old snapshot may be the last reference to a million entries: freed outside the lock.
        const std::lock_guard<std::mutex> lock(pointerMutex);
        snapshot.swap(next);
    }
    std::vector<std::int64_t> takeDirty() {
        const std::lock_guard<std::mutex> lock(dirtyMutex);
        return std::exchange(dirty, {});
    }
    void mark(const std::vector<std::int64_t>& ids) {
        const std::lock_guard<std::mutex> lock(dirtyMutex);
        dirty.insert(dirty.end(), ids.begin(), ids.end());
    }
};

CollectionIndex::CollectionIndex(store::Store& store, telemetry::LoggerPtr log, Signatures where)
    : store_(store), log_(std::move(log)), where_(where), surfaces_(store) {}

CollectionIndex::~CollectionIndex() = default;

/// One thread reads from the store while others decode, which takes longer. At most `batches` are in
/// progress at a time; 1 uses a single processor.
Result<SignatureSet> CollectionIndex::readSignatures(std::int64_t collectionId, std::size_t batches,
                                                     const RunContext& context) const {
    namespace flow = oneapi::tbb;
    using Rows = std::shared_ptr<std::vector<store::IndexRow>>;
    using Block = std::shared_ptr<const SignatureBlock>;
    std::optional<Error> failure;
    std::int64_t afterId = 0;
    bool last = false;
    const auto readBatch = [&](flow::flow_control& control) -> Rows {
        const auto stop = [&](const Error& error) {
            failure = error;
            control.stop();
            return Rows();
        };
        if (last) {
            control.stop();
            return {};
        }
        if (const auto go = context.checkpoint(); !go) return stop(go.error());
        auto rows = store_.loadIndex(collectionId, afterId, kLoadBatch);
        if (!rows) return stop(rows.error());
        last = rows->size() < kLoadBatch;
        if (!rows->empty()) afterId = rows->back().shapeId;
        return std::make_shared<std::vector<store::IndexRow>>(std::move(*rows));
    };
    const auto decodeBatch = [&](const Rows& rows) { return toBlock(std::move(*rows), *log_); };
    std::vector<Block> blocks;
    const auto append = [&](const Block& block) { blocks.push_back(block); };
    flow::parallel_pipeline(batches,
                            flow::make_filter<void, Rows>(flow::filter_mode::serial_in_order, readBatch) &
                                flow::make_filter<Rows, Block>(flow::filter_mode::parallel, decodeBatch) &
                                flow::make_filter<Block, void>(flow::filter_mode::serial_in_order, append));
    if (failure) return fail(*failure);
    return SignatureSet::ofBlocks(blocks);
}

Result<SnapshotPtr> CollectionIndex::read(const store::Collection& collection, std::size_t batches,
                                          const RunContext& context) const {
    auto snapshot = withoutSignatures(collection);
    RETURN_IF_ERROR(snapshot);
    if (where_ == Signatures::kElsewhere) return SnapshotPtr(std::move(*snapshot));

    auto signatures = readSignatures(collection.id, batches, context);
    RETURN_IF_ERROR(signatures);
    (*snapshot)->signatures = std::move(*signatures);
    return SnapshotPtr(std::move(*snapshot));
}

Result<SnapshotPtr> CollectionIndex::readOrMark(const store::Collection& collection,
                                                const RunContext& context) const {
    std::shared_ptr<Snapshot> marked;
    if (collection.damage) {
        marked = withoutRow(collection);
    } else if (auto empty = withoutSignatures(collection); !empty) {
        marked = withoutParameters(collection, empty.error());
    } else {
        auto whole = read(collection, batchesOfAllProcessors(), context);
        if (whole || whole.error().code != ErrorCode::kDataLoss) return whole;
        marked = withoutSearches(**empty, whole.error());
    }
    log_->error("a collection is damaged; the others are served", telemetry::fieldsOf(*marked->damage));
    return SnapshotPtr(std::move(marked));
}

std::size_t CollectionIndex::damaged() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::size_t count = 0;
    for (const auto& [id, slot] : directory_.byId) count += slot->current()->damage ? 1 : 0;
    return count;
}

void CollectionIndex::insert(Directory& directory, SlotPtr slot) const {
    const store::Collection& collection = slot->current()->collection;
    directory.byId[collection.id] = slot;
    if (!collection.name.empty()) directory.byName[collection.name] = std::move(slot);
}

Result<void> CollectionIndex::loadAll(const RunContext& context) {
    return guarded([&] { return loadAllUnguarded(context); });
}

Result<void> CollectionIndex::loadAllUnguarded(const RunContext& context) {
    const auto collections = store_.listCollections();
    RETURN_IF_ERROR(collections);
    Directory next;
    for (const store::Collection& collection : *collections) {
        Result<SnapshotPtr> snapshot = readOrMark(collection, context);
        RETURN_IF_ERROR(snapshot);
        auto slot = std::make_shared<Slot>();
        slot->publish(*snapshot);
        insert(next, std::move(slot));
    }
    RETURN_IF_ERROR(readAliases(next));
    surfaces_.clear();
    const std::lock_guard<std::mutex> lock(mutex_);
    // The old directory is freed with `next`, after the lock has been released.
    std::swap(directory_, next);
    return {};
}

Result<void> CollectionIndex::readAliases(Directory& directory) const {
    const auto aliases = store_.listAliases();
    if (!aliases) {
        if (aliases.error().code != ErrorCode::kDataLoss) return fail(aliases.error());
        log_->error("aliases cannot be read: only the collections' own names are known",
                    telemetry::fieldsOf(aliases.error()));
        directory.aliasDamage = aliases.error();
        return {};
    }
    for (const store::Alias& alias : *aliases) {
        directory.aliases[alias.name] = alias.collectionId;
        const auto slot = directory.byId.find(alias.collectionId);
        if (slot == directory.byId.end() || !slot->second->current()->collection.name.empty()) continue;
        log_->error("a collection whose name cannot be read has an alias",
                    {{"collection_id", alias.collectionId}, {"alias", alias.name}});
    }
    return {};
}

void CollectionIndex::clear() {
    Directory none;
    surfaces_.clear();
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(directory_, none);  // freed after the lock
}

Result<SnapshotPtr> CollectionIndex::byName(const std::string& name) const {
    SlotPtr slot;
    std::optional<Error> aliasDamage;
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        aliasDamage = directory_.aliasDamage;
        const auto found = directory_.byName.find(name);
        const auto alias = directory_.aliases.find(name);
        if (found != directory_.byName.end()) {
            slot = found->second;
        } else if (alias != directory_.aliases.end()) {
            const auto meant = directory_.byId.find(alias->second);
            if (meant != directory_.byId.end()) slot = meant->second;
        }
    }
    if (slot) return slot->current();
    if (!aliasDamage) {
        return fail(ErrorCode::kNotFound, "there is no collection '" + name + "': create it first");
    }
    return fail(aliasDamage->code, "there is no collection '" + name +
                                       "', and whether it is an alias is not known: " + aliasDamage->message);
}

CollectionIndex::SlotPtr CollectionIndex::find(std::int64_t collectionId) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = directory_.byId.find(collectionId);
    return found == directory_.byId.end() ? nullptr : found->second;
}

Result<SnapshotPtr> CollectionIndex::byId(std::int64_t collectionId) const {
    const SlotPtr slot = find(collectionId);
    if (!slot) return fail(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
    return slot->current();
}

std::vector<SnapshotPtr> CollectionIndex::all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<SnapshotPtr> snapshots;
    for (const auto& [name, slot] : directory_.byName) snapshots.push_back(slot->current());
    return snapshots;
}

Result<SnapshotPtr> CollectionIndex::add(const store::Collection& collection) {
    auto snapshot = withoutSignatures(collection);
    RETURN_IF_ERROR(snapshot);
    auto slot = std::make_shared<Slot>();
    slot->publish(*snapshot);
    const std::lock_guard<std::mutex> lock(mutex_);
    insert(directory_, std::move(slot));
    return SnapshotPtr(std::move(*snapshot));
}

Result<void> CollectionIndex::prepare(const store::Collection& collection, const RunContext& context) {
    return guarded([&]() -> Result<void> {
        Result<SnapshotPtr> snapshot = read(collection, kBatchesWhileServing, context);
        RETURN_IF_ERROR(snapshot);
        auto slot = std::make_shared<Slot>();
        slot->publish(*snapshot);
        const std::lock_guard<std::mutex> lock(mutex_);
        directory_.byId[collection.id] = std::move(slot);
        return {};
    });
}

Result<SnapshotPtr> CollectionIndex::show(std::int64_t collectionId) {
    const SlotPtr slot = find(collectionId);
    if (!slot) return fail(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
    SnapshotPtr snapshot = slot->current();
    const std::lock_guard<std::mutex> lock(mutex_);
    directory_.byName[snapshot->collection.name] = slot;
    return snapshot;
}

void CollectionIndex::remove(std::int64_t collectionId) {
    // Declared before the lock, so that a large snapshot is freed after it.
    SlotPtr removed;
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = directory_.byId.find(collectionId);
    if (found == directory_.byId.end()) return;
    removed = found->second;
    directory_.byId.erase(found);
    for (auto alias = directory_.aliases.begin(); alias != directory_.aliases.end();) {
        alias = alias->second == collectionId ? directory_.aliases.erase(alias) : std::next(alias);
    }
    // The name may be taken again by now.
    const auto named = directory_.byName.find(removed->current()->collection.name);
    if (named != directory_.byName.end() && named->second == removed) directory_.byName.erase(named);
}

Result<SnapshotPtr> CollectionIndex::rename(std::int64_t collectionId,
                                            const std::function<Result<store::Collection>()>& change) {
    const SlotPtr slot = find(collectionId);
    if (!slot) return fail(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
    // Reloads look the collection up by the name of the snapshot.
    const std::lock_guard<std::mutex> apply(slot->apply);
    const SnapshotPtr before = slot->current();
    auto renamed = change();
    RETURN_IF_ERROR(renamed);
    auto next = std::make_shared<Snapshot>(*before);
    next->collection.name = renamed->name;
    slot->publish(next);
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto old = directory_.byName.find(before->collection.name);
    if (old != directory_.byName.end() && old->second == slot) directory_.byName.erase(old);
    // Unless it was deleted meanwhile.
    if (directory_.byId.count(collectionId) > 0) directory_.byName[renamed->name] = slot;
    return SnapshotPtr(std::move(next));
}

void CollectionIndex::setAlias(const std::string& name, std::int64_t collectionId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (directory_.byId.count(collectionId) > 0) directory_.aliases[name] = collectionId;
}

void CollectionIndex::removeAlias(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    directory_.aliases.erase(name);
}

std::vector<std::string> CollectionIndex::aliasesOf(std::int64_t collectionId) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<std::string> names;
    for (const auto& [name, id] : directory_.aliases) {
        if (id == collectionId) names.push_back(name);
    }
    return names;
}

Result<void> CollectionIndex::refresh(std::int64_t collectionId, const std::vector<std::int64_t>& shapeIds) {
    forgetSurfaces(shapeIds);
    const SlotPtr slot = find(collectionId);
    if (!slot || where_ == Signatures::kElsewhere) return {};
    return guarded([&] {
        // Before waiting for the lock: the next thread that gets it applies all marks at once.
        slot->mark(shapeIds);
        const std::lock_guard<std::mutex> lock(slot->apply);
        return slot->stale ? reloadLocked(*slot) : applyDirty(*slot);
    });
}

/// Applies the marked shapes; there may be none when the thread before applied ours too.
Result<void> CollectionIndex::applyDirty(Slot& slot) {
    std::vector<std::int64_t> ids = slot.takeDirty();
    if (ids.empty()) return {};
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());

    const bool wasStale = std::exchange(slot.stale, true);  // until all is applied
    const SnapshotPtr before = slot.current();
    std::vector<IndexEntry> updates;
    std::vector<std::int64_t> removed;
    for (const std::int64_t id : ids) {
        const auto shape = store_.getShapeById(id);
        auto row = shape ? store_.getSignature(id) : Result<store::SignatureRow>(fail(shape.error()));
        if (!row && row.error().code != ErrorCode::kNotFound && row.error().code != ErrorCode::kNotReady) {
            return fail(row.error());
        }
        // Of another generation: a switch is in progress, and its reload brings this shape.
        if (row && row->generation != before->collection.generation) continue;
        IndexEntry entry;
        if (row && toEntry({id, shape->key, shape->metadata, std::move(*row)}, entry, *log_)) {
            updates.push_back(std::move(entry));
        } else {
            // Deleted, not segmented yet, failed or damaged: not searched.
            removed.push_back(id);
        }
    }
    auto next = std::make_shared<Snapshot>(*before);
    next->signatures = before->signatures.with(updates, std::move(removed));
    slot.publish(std::move(next));
    slot.stale = wasStale;
    return {};
}

Result<void> CollectionIndex::reloadLocked(Slot& slot) {
    surfaces_.clear();
    slot.stale = true;
    // What is marked by now will be read; later marks are applied afterwards.
    slot.takeDirty();
    const auto collection = store_.getCollection(slot.current()->collection.name);
    RETURN_IF_ERROR(collection);
    Result<SnapshotPtr> snapshot = read(*collection, kBatchesWhileServing, {});
    RETURN_IF_ERROR(snapshot);
    slot.publish(*snapshot);
    slot.stale = false;
    return applyDirty(slot);
}

Result<void> CollectionIndex::reload(std::int64_t collectionId) {
    const SlotPtr slot = find(collectionId);
    if (!slot) return fail(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
    return guarded([&] {
        const std::lock_guard<std::mutex> lock(slot->apply);
        return reloadLocked(*slot);
    });
}

bool CollectionIndex::whileGeneration(std::int64_t collectionId, std::int64_t generation,
                                      const std::function<void()>& commit) {
    const SlotPtr slot = find(collectionId);
    if (!slot) return false;
    const std::shared_lock<std::shared_mutex> gate(slot->gate);
    {
        // Released before `commit`, which may take long. The gate alone keeps the generation.
        const std::lock_guard<std::mutex> lock(slot->apply);
        if (slot->stale && !guarded([&] { return reloadLocked(*slot); })) return false;
    }
    if (slot->current()->collection.generation != generation) return false;
    commit();
    return true;
}

Result<bool> CollectionIndex::switchGeneration(std::int64_t collectionId,
                                               const std::function<Result<bool>()>& change) {
    const SlotPtr slot = find(collectionId);
    if (!slot) return fail(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
    const std::unique_lock<std::shared_mutex> gate(slot->gate);
    const Result<bool> changed = change();
    if (!changed || !*changed) return changed;
    const std::lock_guard<std::mutex> lock(slot->apply);
    const Result<void> reloaded = guarded([&] { return reloadLocked(*slot); });
    RETURN_IF_ERROR(reloaded);
    return true;
}

CollectionIndex::Totals CollectionIndex::totals() const {
    Totals totals;
    for (const SnapshotPtr& snapshot : all()) {
        totals.signatures += snapshot->signatures.size();
        totals.bytes += snapshot->signatures.memoryBytes();
    }
    return totals;
}

}  // namespace shapedb::index
