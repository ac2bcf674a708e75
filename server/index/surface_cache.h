// SPDX-License-Identifier: GPL-3.0-or-later
// Surface points of shapes, read from the store when a search verifies them and kept for the next.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "core/base/error.h"
#include "core/fit/surface_points.h"
#include "server/store/store.h"

namespace shapedb::index {

/// Keeps the surfaces that were used last. Thread-safe; reads the store without a lock held.
class SurfaceCache {
  public:
    /// A surface takes 12 KB: 48 MB in all.
    static constexpr std::size_t kMostSurfaces = 4096;

    /// `store` is not owned and must outlive the cache. `most`: at least 1.
    explicit SurfaceCache(store::Store& store, std::size_t most = kMostSurfaces)
        : store_(store), most_(most) {}

    /// Null for a shape that has none (yet) or was deleted. Errors: those of the store; kDataLoss (damaged,
    /// names the shape), kSchemaTooNew.
    [[nodiscard]] Result<std::shared_ptr<const SurfacePoints>> get(std::int64_t shapeId);

    /// To be called after the surface of a shape has changed in the store: no later `get` returns the old
    /// one.
    void forget(std::int64_t shapeId);
    void clear();

  private:
    struct Entry {
        std::int64_t shapeId = 0;
        std::shared_ptr<const SurfacePoints> surface;
    };
    using Entries = std::list<Entry>;  // used last first

    void insert(std::int64_t shapeId, std::shared_ptr<const SurfacePoints> surface);

    store::Store& store_;
    const std::size_t most_;
    std::mutex mutex_;
    Entries entries_;
    std::unordered_map<std::int64_t, Entries::iterator> byShape_;
    std::uint64_t changes_ = 0;  ///< calls of forget and clear
};

}  // namespace shapedb::index
