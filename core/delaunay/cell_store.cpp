// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/cell_store.h"

#include <algorithm>

namespace shapedb {

void CellStore::reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    LargeBlock<Cell> cells = allocateLarge<Cell>(capacity);
    LargeBlock<DelaunayBall> balls = allocateLarge<DelaunayBall>(capacity);
    std::copy_n(cells_.get(), used(), cells.get());
    std::copy_n(balls_.get(), used(), balls.get());
    cells_ = std::move(cells);
    balls_ = std::move(balls);
    capacity_ = capacity;
}

std::uint32_t CellStore::take(std::uint32_t count) {
    const std::size_t first = used_.fetch_add(count, std::memory_order_relaxed);
    if (first + count <= capacity_) return static_cast<std::uint32_t>(first);
    // Until this is undone, other claims may fail although there is room, which only postpones their points.
    // No cell is given out twice: a claim that fails leaves the count above the capacity.
    used_.fetch_sub(count, std::memory_order_relaxed);
    return kNoCell;
}

}  // namespace shapedb
