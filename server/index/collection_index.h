// The cache that answers searches: for each collection its parameters and all its
// signatures, as one immutable snapshot that is swapped as a whole.
//
// The store is the truth. Whoever changes a shape there calls `refresh` afterwards, which
// reads the truth again: so the order in which threads come here does not matter, and no
// update can resurrect a shape that was deleted meanwhile.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/pipeline.h"
#include "core/search/signature_set.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::index {

/// What a search reads: signatures and the parameters they were made with. Immutable.
struct Snapshot {
    store::Collection collection;
    ShapeParameters parameters;  ///< of collection.parameters
    SignatureSet signatures;     ///< all of generation collection.generation
};

using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// Thread-safe. Readers (`byName`, `byId`, `all`) copy a pointer under a lock nobody holds
/// longer than that; they never wait for an update. Updates of one collection are applied one
/// after another; updates that arrive meanwhile are applied together by the next in line.
///
/// Errors common to all functions that read the store: kStorage and the like, as store.h.
class CollectionIndex {
  public:
    /// Neither is owned; both must outlive the index.
    CollectionIndex(store::Store& store, telemetry::LoggerPtr log);
    ~CollectionIndex();

    /// Reads everything anew, on all processors, and swaps it in at the end (start, restore). Signatures that
    /// cannot be decoded are logged and left out. Errors: kCancelled, kDeadlineExceeded;
    /// kDataLoss: parameters of a collection, which is named.
    [[nodiscard]] Result<void> loadAll(const RunContext& context = {});

    /// Errors: kNotFound.
    [[nodiscard]] Result<SnapshotPtr> byName(const std::string& name) const;
    /// Errors: kNotFound.
    [[nodiscard]] Result<SnapshotPtr> byId(std::int64_t collectionId) const;
    /// By name.
    [[nodiscard]] std::vector<SnapshotPtr> all() const;

    /// Adds a collection the store has just created, empty. Errors: kDataLoss (its parameters).
    [[nodiscard]] Result<SnapshotPtr> add(const store::Collection& collection);
    /// Forgets a collection; unknown ids are ignored. Running searches keep their snapshot.
    void remove(std::int64_t collectionId);

    /// Brings one shape up to date with the store. When it returns, searches that start see
    /// at least what was committed before the call. A collection that is gone is no error.
    [[nodiscard]] Result<void> refresh(std::int64_t collectionId, std::int64_t shapeId);

    /// Reads one collection anew. Errors: kNotFound, kDataLoss.
    [[nodiscard]] Result<void> reload(std::int64_t collectionId);

    /// Calls `commit` if `generation` is the one that serves and keeps it so until `commit`
    /// returns; false, without calling it, when it is not or the collection is gone. A
    /// signature made with old parameters can thus never be stored as a new one.
    [[nodiscard]] bool whileGeneration(std::int64_t collectionId, std::int64_t generation,
                                       const std::function<void()>& commit);

    /// Calls `change`, which may switch the collection to its next generation in the store
    /// and then returns true; reloads the collection before any `whileGeneration` goes on.
    /// Returns what `change` returned. Errors: those of `change` and of `reload`.
    [[nodiscard]] Result<bool> switchGeneration(std::int64_t collectionId,
                                                const std::function<Result<bool>()>& change);

    struct Totals {
        std::uint64_t signatures = 0;
        std::uint64_t bytes = 0;  ///< about
    };
    [[nodiscard]] Totals totals() const;

  private:
    struct Slot;
    using SlotPtr = std::shared_ptr<Slot>;
    struct Directory {
        std::map<std::string, SlotPtr> byName;
        std::map<std::int64_t, SlotPtr> byId;
    };

    SlotPtr find(std::int64_t collectionId) const;
    Result<void> loadAllUnguarded(const RunContext& context);
    Result<SnapshotPtr> read(const store::Collection& collection, std::size_t batches,
                             const RunContext& context) const;
    Result<SignatureSet> readSignatures(std::int64_t collectionId, std::size_t batches,
                                        const RunContext& context) const;
    Result<void> reloadLocked(Slot& slot);
    Result<void> applyDirty(Slot& slot);
    void insert(Directory& directory, SlotPtr slot) const;

    store::Store& store_;
    telemetry::LoggerPtr log_;
    mutable std::mutex mutex_;  ///< guards directory_; held only to look up or to swap
    Directory directory_;
};

}  // namespace shapedb::index
