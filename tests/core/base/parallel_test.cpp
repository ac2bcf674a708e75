// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

namespace shapedb {
namespace {

TEST(Parallel, RangesCoverEveryIndexExactlyOnce) {
    for (const int threads : {1, 3}) {
        tbb::task_arena arena(threads);
        for (const std::size_t count : {0U, 1U, 99U, 100U, 101U, 12345U}) {
            std::vector<int> seen(count, 0);
            std::atomic<std::size_t> widest{0};
            const auto done = arena.execute([&] {
                return parallelFor(count, 100, {}, [&](std::size_t begin, std::size_t end) {
                    std::size_t known = widest;
                    while (known < end - begin && !widest.compare_exchange_weak(known, end - begin)) {
                    }
                    for (std::size_t i = begin; i < end; ++i) ++seen[i];
                });
            });
            EXPECT_TRUE(done);
            EXPECT_LE(widest, 100U);
            EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(count));
        }
    }
}

TEST(Parallel, StopsWhenCancelled) {
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    std::atomic<std::size_t> done{0};
    const auto result = parallelFor(1000000, 10, context, [&](std::size_t begin, std::size_t end) {
        done += end - begin;
        if (done > 1000) cancel = true;
    });
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
    EXPECT_LT(done, 500000U);
}

TEST(Parallel, ArenaAndGlobalLimitBoundTheThreadCount) {
    tbb::task_arena arena(3);
    EXPECT_EQ(arena.execute([] { return threadsOfArena(); }),
              std::min<std::size_t>(
                  3, tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(arena.execute([] { return threadsOfArena(); }), 1U);
}

}  // namespace
}  // namespace shapedb
