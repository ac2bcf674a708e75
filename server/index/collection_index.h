// SPDX-License-Identifier: GPL-3.0-or-later
// The index that answers searches: for each collection an immutable snapshot of its parameters and
// signatures, replaced as a whole.
//
// The store is the truth. After a change there, `refresh` reads the shape again: the order of calls
// does not matter, and no update can bring back a shape that was deleted meanwhile.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/pipeline.h"
#include "core/search/signature_set.h"
#include "server/index/surface_cache.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::index {

/// What a search reads: signatures, and the parameters that made them. Immutable.
struct Snapshot {
    store::Collection collection;
    ShapeParameters parameters;  ///< of collection.parameters
    SignatureSet signatures;     ///< all of generation collection.generation; empty where others hold them
    /// Why signatures are missing: those stored could not be read. The collection must not be searched, since
    /// nobody could tell what was not found.
    std::optional<Error> damage{};
    /// False, with `damage`: they could not be read, and `parameters` are not those of the collection.
    bool parametersKnown = true;

    /// Before `parameters` are used. Errors: kDataLoss.
    [[nodiscard]] Result<void> requireParameters() const {
        return parametersKnown ? Result<void>() : Result<void>(fail(*damage));
    }
};

using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// Where the signatures are that searches read.
enum class Signatures {
    kHere,       ///< in this index
    kElsewhere,  ///< in shards (server/cluster): the index knows collections and their parameters only
};

/// Thread-safe. Readers (`byName`, `byId`, `all`) only copy a pointer under a short lock and never wait
/// for updates. Updates of one collection run one after another; those that arrive meanwhile are applied
/// together by the next.
///
/// Functions that read the store also have its errors (store.h).
class CollectionIndex {
  public:
    /// Neither is owned; both must outlive the index.
    CollectionIndex(store::Store& store, telemetry::LoggerPtr log, Signatures where = Signatures::kHere);
    ~CollectionIndex();

    /// Reads everything on all processors and replaces the index at the end (start, restore). Damaged
    /// signatures are logged and left out; a collection that cannot be read, be it its signatures, its
    /// parameters or its row, is logged and marked (Snapshot::damage), the others are served. Aliases that
    /// cannot be read are logged. Errors: kCancelled, kDeadlineExceeded; kDataLoss (no list of collections
    /// can be made).
    [[nodiscard]] Result<void> loadAll(const RunContext& context = {});

    /// Collections marked as damaged, also those whose name nobody knows.
    [[nodiscard]] std::size_t damaged() const;

    /// Forgets everything; running searches keep their snapshot.
    void clear();

    /// By its name or an alias. Errors: kNotFound; kDataLoss (no collection has the name, and aliases could
    /// not be read).
    [[nodiscard]] Result<SnapshotPtr> byName(const std::string& name) const;
    /// Errors: kNotFound.
    [[nodiscard]] Result<SnapshotPtr> byId(std::int64_t collectionId) const;
    /// By name.
    [[nodiscard]] std::vector<SnapshotPtr> all() const;

    /// Adds a collection that was just created, empty. Errors: kDataLoss (its parameters).
    [[nodiscard]] Result<SnapshotPtr> add(const store::Collection& collection);
    /// Reads a collection that nobody knows yet. Until `show`, it is found by its id alone. Errors:
    /// kDataLoss, kCancelled, kDeadlineExceeded.
    [[nodiscard]] Result<void> prepare(const store::Collection& collection, const RunContext& context);
    /// Makes a prepared collection known under its name. Errors: kNotFound.
    [[nodiscard]] Result<SnapshotPtr> show(std::int64_t collectionId);
    /// Removes a collection; ignores unknown ids. Running searches keep their snapshot.
    void remove(std::int64_t collectionId);

    /// Calls `change`, which renames the collection in the store, and shows it under its new name; nothing
    /// reads the collection again in between. Errors: kNotFound; those of `change`.
    [[nodiscard]] Result<SnapshotPtr> rename(std::int64_t collectionId,
                                             const std::function<Result<store::Collection>()>& change);
    /// At one moment `name` stands for this collection, and for no other any more.
    void setAlias(const std::string& name, std::int64_t collectionId);
    void removeAlias(const std::string& name);
    /// The aliases of a collection, in ascending order.
    [[nodiscard]] std::vector<std::string> aliasesOf(std::int64_t collectionId) const;

    /// Reads shapes of one collection again. Searches that start afterwards see at least what was committed
    /// before the call. No error when the collection is gone.
    [[nodiscard]] Result<void> refresh(std::int64_t collectionId, const std::vector<std::int64_t>& shapeIds);
    [[nodiscard]] Result<void> refresh(std::int64_t collectionId, std::int64_t shapeId) {
        return refresh(collectionId, std::vector<std::int64_t>{shapeId});
    }

    /// Reads one collection again. Errors: kNotFound, kDataLoss.
    [[nodiscard]] Result<void> reload(std::int64_t collectionId);

    /// Calls `commit` if `generation` serves, and keeps it serving until `commit` returns. False, without
    /// calling it, when another generation serves or the collection is gone. Thus a signature made with
    /// old parameters is never stored as a new one.
    [[nodiscard]] bool whileGeneration(std::int64_t collectionId, std::int64_t generation,
                                       const std::function<void()>& commit);

    /// Calls `change`, which returns true if it switched the collection to its next generation in the
    /// store; then reloads the collection before any `whileGeneration` continues. Returns what `change`
    /// returned. Errors: those of `change` and of `reload`.
    [[nodiscard]] Result<bool> switchGeneration(std::int64_t collectionId,
                                                const std::function<Result<bool>()>& change);

    [[nodiscard]] Signatures where() const noexcept { return where_; }
    /// Surface points that are cached may be older than those stored now.
    void forgetSurfaces(const std::vector<std::int64_t>& shapeIds) {
        for (const std::int64_t id : shapeIds) surfaces_.forget(id);
    }
    /// The surface points of a shape, cached (surface_cache.h).
    [[nodiscard]] Result<std::shared_ptr<const SurfacePoints>> surface(std::int64_t shapeId) {
        return surfaces_.get(shapeId);
    }

    struct Totals {
        std::uint64_t signatures = 0;
        std::uint64_t bytes = 0;  ///< approximate
    };
    [[nodiscard]] Totals totals() const;

  private:
    struct Slot;
    using SlotPtr = std::shared_ptr<Slot>;
    struct Directory {
        std::map<std::string, SlotPtr> byName;
        std::map<std::int64_t, SlotPtr> byId;
        std::map<std::string, std::int64_t> aliases;
        std::optional<Error> aliasDamage;  ///< why some aliases may be missing
    };

    SlotPtr find(std::int64_t collectionId) const;
    Result<void> loadAllUnguarded(const RunContext& context);
    Result<void> readAliases(Directory& directory) const;
    Result<SnapshotPtr> readOrMark(const store::Collection& collection, const RunContext& context) const;
    Result<SnapshotPtr> read(const store::Collection& collection, std::size_t batches,
                             const RunContext& context) const;
    Result<SignatureSet> readSignatures(std::int64_t collectionId, std::size_t batches,
                                        const RunContext& context) const;
    Result<void> reloadLocked(Slot& slot);
    Result<void> applyDirty(Slot& slot);
    void insert(Directory& directory, SlotPtr slot) const;

    store::Store& store_;
    telemetry::LoggerPtr log_;
    const Signatures where_;
    SurfaceCache surfaces_;
    mutable std::mutex mutex_;  ///< guards directory_; held only to look up or to replace
    Directory directory_;
};

}  // namespace shapedb::index
