// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/view_search.h"

#include <algorithm>
#include <atomic>
#include <new>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/search/signature_block.h"

namespace shapedb {

namespace {

bool isNearer(const ViewHit& a, const ViewHit& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.id < b.id;
}

// The nearest `count` of a block, as a heap. `limit` is never below the distance of the last hit of the whole
// search: rows beyond are no hits, and a full heap may lower it.
std::vector<ViewHit> nearestOfBlock(const ViewQuery& query, const SignatureBlock& block, std::size_t count,
                                    const std::vector<std::uint8_t>& wanted,
                                    std::atomic<std::uint32_t>& limit) {
    std::vector<ViewHit> hits;
    for (std::size_t row = 0; row < block.size(); ++row) {
        const ShapeViews* views = block.views(row);
        if (views == nullptr || (!wanted.empty() && wanted[row] == 0)) continue;
        const std::uint32_t most = limit.load(std::memory_order_relaxed);
        const ViewHit hit{block.id(row), query.distance(*views, most)};
        if (hit.distance > most) continue;
        hits.push_back(hit);
        std::push_heap(hits.begin(), hits.end(), isNearer);
        if (hits.size() > count) {
            std::pop_heap(hits.begin(), hits.end(), isNearer);
            hits.pop_back();
        }
        if (hits.size() < count) continue;
        std::uint32_t known = most;
        while (hits.front().distance < known &&
               !limit.compare_exchange_weak(known, hits.front().distance, std::memory_order_relaxed)) {
        }
    }
    return hits;
}

}  // namespace

Result<std::vector<ViewHit>> nearestByViews(const ViewQuery& query, const SignatureSet& set,
                                            std::size_t count, const Filter& filter,
                                            std::optional<std::int64_t> excludeId,
                                            const RunContext& context) {
    if (count == 0) return std::vector<ViewHit>();
    try {
        const auto& blocks = set.blocks();
        std::vector<std::vector<ViewHit>> found(blocks.size());
        std::atomic<std::uint32_t> limit{UINT32_MAX};
        context.report("views", 0, blocks.size());
        RETURN_IF_ERROR(parallelFor(blocks.size(), 1, context, [&](std::size_t i, std::size_t) {
            found[i] =
                nearestOfBlock(query, *blocks[i], count, wantedRows(*blocks[i], filter, excludeId), limit);
        }));
        context.report("views", blocks.size(), blocks.size());
        std::vector<ViewHit> all;
        for (const auto& hits : found) all.insert(all.end(), hits.begin(), hits.end());
        std::sort(all.begin(), all.end(), isNearer);
        if (all.size() > count) all.resize(count);
        return all;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to compare views");
    }
}

}  // namespace shapedb
