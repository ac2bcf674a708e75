// SPDX-License-Identifier: GPL-3.0-or-later
// Memory for the cells of a triangulation and their cached balls.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/base/large_block.h"
#include "core/delaunay/cell.h"
#include "core/delaunay/delaunay_ball.h"

namespace shapedb {

/// Two arrays, indexed by cell: cells and balls. They are handed out from the front and never shrink; pages
/// not yet reached take no memory.
///
/// Thread-safety: `take` may be called concurrently, `reserve` and the recyclers only while nobody else uses
/// the store. Different cells may be written by different threads.
class CellStore {
  public:
    /// Makes room for at least `capacity` cells, keeping those in use. Throws std::bad_alloc.
    void reserve(std::size_t capacity) {
        if (capacity <= capacity_) return;
        LargeBlock<Cell> cells = allocateLarge<Cell>(capacity);
        LargeBlock<DelaunayBall> balls = allocateLarge<DelaunayBall>(capacity);
        std::copy_n(cells_.get(), used(), cells.get());
        std::copy_n(balls_.get(), used(), balls.get());
        cells_ = std::move(cells);
        balls_ = std::move(balls);
        capacity_ = capacity;
    }
    /// The first of `count` consecutive cells, uninitialised; kNoCell when there is no room.
    std::uint32_t take(std::uint32_t count) {
        const std::size_t first = used_.fetch_add(count, std::memory_order_relaxed);
        if (first + count <= capacity_) return static_cast<std::uint32_t>(first);
        // Until this is undone, other claims may fail although there is room, which only postpones their
        // points. No cell is given out twice: a claim that fails leaves the count above the capacity.
        used_.fetch_sub(count, std::memory_order_relaxed);
        return kNoCell;
    }

    Cell& operator[](std::uint32_t i) { return cells_[i]; }
    const Cell& operator[](std::uint32_t i) const { return cells_[i]; }
    DelaunayBall& ball(std::uint32_t i) { return balls_[i]; }
    const DelaunayBall& ball(std::uint32_t i) const { return balls_[i]; }

    std::size_t used() const { return used_.load(std::memory_order_relaxed); }
    std::size_t capacity() const { return capacity_; }

    /// Give up the balls once no more points go in, and the cells once they have been copied.
    PageRecycler recycleBalls() { return PageRecycler(std::move(balls_)); }
    PageRecycler recycleCells() { return PageRecycler(std::move(cells_)); }

  private:
    LargeBlock<Cell> cells_;
    LargeBlock<DelaunayBall> balls_;
    std::atomic<std::size_t> used_{0};
    std::size_t capacity_ = 0;
};

}  // namespace shapedb
