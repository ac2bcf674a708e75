// SPDX-License-Identifier: Apache-2.0
// Uninitialised memory for large arrays, on huge pages where the system has them: random access to an array
// of hundreds of megabytes waits as much for page tables as for memory.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace shapedb {

namespace large_block {

/// Blocks of this size and more are mapped from the system and returned to it at once; smaller ones come
/// from the heap.
constexpr std::size_t kMinMapped = std::size_t{1} << 20;
/// Blocks of this size and more ask for huge pages; in smaller ones the unused end of a page would matter.
constexpr std::size_t kMinHugePages = std::size_t{1} << 23;

/// Null when out of memory. Aligned to at least 64 bytes. Thread-safe.
[[nodiscard]] void* allocate(std::size_t bytes) noexcept;
/// `bytes`: as given to allocate.
void release(void* block, std::size_t bytes) noexcept;
/// Moves whole pages from the front of one block (`left` bytes remain of it) to the front of another. The
/// content of both is lost. Returns how many bytes `from` lost; 0 where pages cannot be moved. `from` is the
/// beginning of a block, or the point up to which earlier calls emptied it; `to` is the beginning of a block.
[[nodiscard]] std::size_t movePages(void* from, std::size_t left, void* to, std::size_t bytes) noexcept;

}  // namespace large_block

/// The deleter of allocateLarge.
struct FreeLarge {
    std::size_t bytes = 0;
    void operator()(void* block) const noexcept { large_block::release(block, bytes); }
};

template <typename T>
using LargeBlock = std::unique_ptr<T[], FreeLarge>;

/// Uninitialised room for `count` elements of a trivial type; pages that are never written take no memory.
/// Throws std::bad_alloc.
template <typename T>
[[nodiscard]] LargeBlock<T> allocateLarge(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    static_assert(alignof(T) <= 64);
    if (count > static_cast<std::size_t>(-1) / 2 / sizeof(T)) throw std::bad_alloc();
    const std::size_t bytes = count * sizeof(T);
    void* block = large_block::allocate(bytes);
    if (block == nullptr) throw std::bad_alloc();
    return LargeBlock<T>(static_cast<T*>(block), FreeLarge{bytes});
}

/// The same for vectors. Elements that resize() adds are uninitialised.
template <typename T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <typename U>
    LargeAllocator(const LargeAllocator<U>&) noexcept {}  // NOLINT: allocators convert

    T* allocate(std::size_t count) { return allocateLarge<T>(count).release(); }
    void deallocate(T* block, std::size_t count) noexcept { FreeLarge{count * sizeof(T)}(block); }

    // Default member initialisers are skipped too: writing them would touch every page for nothing.
    template <typename U>
    void construct(U*) noexcept {
        static_assert(std::is_trivially_copyable_v<U> && std::is_trivially_destructible_v<U>);
    }
    template <typename U, typename... Arguments>
    void construct(U* at, Arguments&&... arguments) {
        ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
    friend bool operator==(const LargeAllocator&, const LargeAllocator&) { return true; }
    friend bool operator!=(const LargeAllocator&, const LargeAllocator&) { return false; }
};

template <typename T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

/// Reuses the pages of a block that is no longer needed for new vectors. Pages fresh from the system would
/// have to be cleared first, which takes as long as writing them.
class PageRecycler {
  public:
    template <typename T>
    explicit PageRecycler(LargeBlock<T>&& block) : left_(block.get_deleter().bytes), next_(block.release()) {}
    PageRecycler(const PageRecycler&) = delete;
    PageRecycler& operator=(const PageRecycler&) = delete;
    ~PageRecycler() {
        if (left_ > 0) large_block::release(next_, left_);
    }

    /// A vector of `count` uninitialised elements, on recycled pages as far as they last.
    template <typename T>
    [[nodiscard]] LargeVector<T> makeVector(std::size_t count) {
        LargeVector<T> vector(count);
        const std::size_t moved = large_block::movePages(next_, left_, vector.data(), count * sizeof(T));
        next_ = static_cast<char*>(next_) + moved;
        left_ -= moved;
        return vector;
    }

  private:
    std::size_t left_;
    void* next_;
};

}  // namespace shapedb
