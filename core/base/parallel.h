// Loops over things that do not depend on each other, on the threads of the caller's arena.
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

/// As many threads as the caller's arena, and whatever limits it, allow; at least 1.
[[nodiscard]] inline std::size_t threadsOfArena() {
    const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return std::min(static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency())), allowed);
}

/// Calls `work(begin, end)` with ranges that together are [0, count), from any thread; a range has at most
/// `block` indices. What `work` writes must belong to its indices; then results have the same bits whatever
/// the number of threads.
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
    // Isolated: a thread that waits for the last block must not begin work of its caller's caller. Ranges
    // are divided down to the block, so that each comes to the checkpoint.
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, block), runBlock,
                          tbb::simple_partitioner());
    });
    if (!stopped) return {};
    // What stopped a block still holds: a cancelled context stays so, and deadlines do not come back.
    return context.checkpoint();
}

/// Calls `work(part, begin, end)` once for each of so many parts of [0, count), as equal as can be and in
/// order. Otherwise as parallelFor.
template <typename Work>
[[nodiscard]] Result<void> parallelForParts(std::size_t count, std::size_t parts, const RunContext& context,
                                            const Work& work) {
    return parallelFor(parts, 1, context, [&](std::size_t part, std::size_t) {
        work(part, part * count / parts, (part + 1) * count / parts);
    });
}

/// Does all of it, on any threads, and returns when all is done.
template <typename... Works>
void parallelInvoke(const Works&... works) {
    // Isolated, as above.
    tbb::this_task_arena::isolate([&] { tbb::parallel_invoke(works...); });
}

/// Calls a copy of `work` with every point of `order`, once each; each block of points, which follow one
/// another in `order`, has a copy of its own. Otherwise as parallelFor.
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
