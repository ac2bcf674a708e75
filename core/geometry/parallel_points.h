// A loop over points that do not depend on each other, on the threads of the caller's arena.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb {

/// Calls a copy of `work` with every point of `order`, once each, from any thread; each block of points,
/// which follow one another in `order`, has a copy of its own. What `work` writes must belong to its
/// point; then results have the same bits whatever the number of threads.
///
/// Errors: kCancelled, kDeadlineExceeded.
template <typename Work>
[[nodiscard]] Result<void> forEachPoint(const std::vector<std::uint32_t>& order, const RunContext& context,
                                        const Work& work) {
    constexpr std::size_t kBlock = 512;
    std::atomic<bool> stopped{false};
    const auto runBlock = [&](const tbb::blocked_range<std::size_t>& block) {
        if (stopped.load(std::memory_order_relaxed)) return;
        if (!context.checkpoint()) {
            stopped.store(true, std::memory_order_relaxed);
            return;
        }
        Work own = work;
        for (std::size_t i = block.begin(); i != block.end(); ++i) own(order[i]);
    };
    // Isolated: a thread that waits for the last block must not begin work of its caller's caller.
    tbb::this_task_arena::isolate(
        [&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), kBlock), runBlock); });
    if (!stopped) return {};
    // What stopped a block still holds: a cancelled context stays so, and deadlines do not come back.
    return context.checkpoint();
}

}  // namespace shapedb
