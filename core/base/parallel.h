// SPDX-License-Identifier: Apache-2.0
// Parallel loops over independent items, on the threads of the caller's oneTBB arena.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb {

/// How many threads the caller's arena and any global limit allow; at least 1.
[[nodiscard]] inline std::size_t threadsOfArena() {
    const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return std::min(static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency())), allowed);
}

/// Calls `work(begin, end)`, on any thread, for ranges of at most `block` indices that together make
/// [0, count). If `work` writes only what belongs to its indices, results have the same bits for any number
/// of threads. Stops between ranges when the context says so.
///
/// Errors: kCancelled, kDeadlineExceeded.
template <typename Work>
[[nodiscard]] Result<void> parallelFor(std::size_t count, std::size_t block, const RunContext& context,
                                       const Work& work) {
    std::atomic<bool> stopped{false};
    const auto runBlock = [&](const tbb::blocked_range<std::size_t>& range) {
        if (stopped.load(std::memory_order_relaxed)) return;
        if (!context.checkpoint()) {
            stopped.store(true, std::memory_order_relaxed);
            return;
        }
        work(range.begin(), range.end());
    };
    // Isolated: a thread waiting for the last range must not pick up unrelated work of an outer loop.
    // simple_partitioner splits down to `block`, so that checkpoints come often enough.
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, block), runBlock,
                          tbb::simple_partitioner());
    });
    if (!stopped) return {};
    // The reason still holds: a context stays cancelled, and a deadline that has passed stays passed.
    return context.checkpoint();
}

/// Divides [0, count) into `parts` nearly equal ranges and calls `work(part, begin, end)` once for each.
/// Otherwise as parallelFor.
template <typename Work>
[[nodiscard]] Result<void> parallelForParts(std::size_t count, std::size_t parts, const RunContext& context,
                                            const Work& work) {
    return parallelFor(parts, 1, context, [&](std::size_t part, std::size_t) {
        work(part, part * count / parts, (part + 1) * count / parts);
    });
}

/// Runs all of `works`, on any threads, and returns when all are done.
template <typename... Works>
void parallelInvoke(const Works&... works) {
    // Isolated, as above.
    tbb::this_task_arena::isolate([&] { tbb::parallel_invoke(works...); });
}

/// Calls `work(point)` once for every point of `order`. Each block of consecutive points gets its own copy of
/// `work`, which may therefore carry state from point to point. Otherwise as parallelFor.
template <typename Work>
[[nodiscard]] Result<void> parallelForPoints(const std::vector<std::uint32_t>& order,
                                             const RunContext& context, const Work& work) {
    constexpr std::size_t kBlock = 512;
    return parallelFor(order.size(), kBlock, context, [&](std::size_t begin, std::size_t end) {
        Work own = work;
        for (std::size_t i = begin; i != end; ++i) own(order[i]);
    });
}

}  // namespace shapedb
