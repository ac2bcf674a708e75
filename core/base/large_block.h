// Memory for large tables: one block, not written until it is used, on large pages where the system has
// them, because reading it at random waits for the page tables as much as for the memory.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace shapedb {

namespace large_block {

/// Blocks from here on come straight from the system and go back to it at once, smaller ones from the heap.
constexpr std::size_t kLeastMapped = std::size_t{1} << 20;
/// From here on large pages are asked for; in less memory the rest of the last one would show.
constexpr std::size_t kLeastOnLargePages = std::size_t{1} << 23;

/// Null when there is no such memory. Aligned to 64 bytes at least. On any thread.
[[nodiscard]] void* take(std::size_t bytes) noexcept;
/// What take gave for as many bytes.
void give(void* block, std::size_t bytes) noexcept;
/// Puts the pages at the front of what is left of one block under another, and what was in either is lost.
/// Returns how many bytes of the first are gone; 0 where that cannot be done. `from` is at the beginning of a
/// block or where such a call left it, `to` at the beginning of one.
[[nodiscard]] std::size_t movePages(void* from, std::size_t left, void* to, std::size_t bytes) noexcept;

}  // namespace large_block

/// Releases what allocateLarge gave.
struct FreeLarge {
    std::size_t bytes = 0;
    void operator()(void* block) const noexcept { large_block::give(block, bytes); }
};

template <typename T>
using LargeBlock = std::unique_ptr<T[], FreeLarge>;

/// Room for `count` of a type that needs no construction, uninitialised; pages that nobody writes take
/// no memory. Throws std::bad_alloc.
template <typename T>
[[nodiscard]] LargeBlock<T> allocateLarge(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    static_assert(alignof(T) <= 64);
    if (count > static_cast<std::size_t>(-1) / 2 / sizeof(T)) throw std::bad_alloc();
    const std::size_t bytes = count * sizeof(T);
    void* block = large_block::take(bytes);
    if (block == nullptr) throw std::bad_alloc();
    return LargeBlock<T>(static_cast<T*>(block), FreeLarge{bytes});
}

/// Such memory for vectors. What resize() adds is not written: it holds anything until it is assigned.
template <typename T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <typename U>
    LargeAllocator(const LargeAllocator<U>&) noexcept {}  // NOLINT: allocators convert

    T* allocate(std::size_t count) { return allocateLarge<T>(count).release(); }
    void deallocate(T* block, std::size_t count) noexcept { FreeLarge{count * sizeof(T)}(block); }

    // Not even members' default values: those would be written, page after page, to be overwritten.
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

/// A block whose content is not needed any more. A new block gets its pages, which the system then need not
/// clear: that takes as long as writing them.
class SpentBlock {
  public:
    template <typename T>
    explicit SpentBlock(LargeBlock<T>&& block) : left_(block.get_deleter().bytes), next_(block.release()) {}
    SpentBlock(const SpentBlock&) = delete;
    SpentBlock& operator=(const SpentBlock&) = delete;
    ~SpentBlock() {
        if (left_ > 0) large_block::give(next_, left_);
    }

    /// A vector of so many elements, which hold anything until they are assigned.
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
