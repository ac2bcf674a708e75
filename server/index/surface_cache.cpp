// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/surface_cache.h"

#include <string>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/fit/surface_points_codec.h"

namespace shapedb::index {

Result<std::shared_ptr<const SurfacePoints>> SurfaceCache::get(std::int64_t shapeId) {
    std::uint64_t before = 0;
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        before = changes_;
        const auto found = byShape_.find(shapeId);
        if (found != byShape_.end()) {
            entries_.splice(entries_.begin(), entries_, found->second);
            return found->second->surface;
        }
    }
    const auto row = store_.getSurface(shapeId);
    if (!row && row.error().code != ErrorCode::kNotFound) return fail(row.error());
    if (!row || !*row) return std::shared_ptr<const SurfacePoints>();
    auto surface = decodeSurfacePoints((*row)->bytes);
    if (!surface) {
        return fail(surface.error().code, "the stored surface points of shape " + std::to_string(shapeId) +
                                              ": " + surface.error().message);
    }
    auto shared = std::make_shared<const SurfacePoints>(std::move(*surface));
    const std::lock_guard<std::mutex> lock(mutex_);
    // What was read may be what a change meanwhile has replaced.
    if (changes_ == before) insert(shapeId, shared);
    return shared;
}

void SurfaceCache::insert(std::int64_t shapeId, std::shared_ptr<const SurfacePoints> surface) {
    if (byShape_.count(shapeId) != 0) return;  // another thread was faster
    entries_.push_front({shapeId, std::move(surface)});
    byShape_[shapeId] = entries_.begin();
    if (entries_.size() <= most_) return;
    byShape_.erase(entries_.back().shapeId);
    entries_.pop_back();
}

void SurfaceCache::forget(std::int64_t shapeId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++changes_;
    const auto found = byShape_.find(shapeId);
    if (found == byShape_.end()) return;
    entries_.erase(found->second);
    byShape_.erase(found);
}

void SurfaceCache::clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++changes_;
    entries_.clear();
    byShape_.clear();
}

}  // namespace shapedb::index
