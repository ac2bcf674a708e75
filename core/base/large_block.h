// Memory for large tables: one block, not written until it is used, on large pages where the system has
// them, because reading it at random waits for the page tables as much as for the memory.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace shapedb {

/// Releases what allocateLarge gave.
struct FreeLarge {
    void operator()(void* block) const noexcept { std::free(block); }
};

template <typename T>
using LargeBlock = std::unique_ptr<T[], FreeLarge>;

/// Room for `count` of a type that needs no construction, uninitialised; pages that nobody writes take
/// no memory. Throws std::bad_alloc.
template <typename T>
[[nodiscard]] LargeBlock<T> allocateLarge(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    constexpr std::size_t kLargePage = std::size_t{1} << 21;
    constexpr std::size_t kSmallPage = std::size_t{1} << 12;
    const std::size_t page = count * sizeof(T) >= kLargePage ? kLargePage : kSmallPage;
    const std::size_t bytes = (count * sizeof(T) / page + 1) * page;
    void* block = std::aligned_alloc(page, bytes);
    if (block == nullptr) throw std::bad_alloc();
#if defined(__linux__)
    if (page == kLargePage) static_cast<void>(madvise(block, bytes, MADV_HUGEPAGE));  // a wish, no more
#endif
    return LargeBlock<T>(static_cast<T*>(block));
}

/// Such memory for vectors. What resize() adds is not written: it holds anything until it is assigned.
template <typename T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <typename U>
    LargeAllocator(const LargeAllocator<U>&) noexcept {}  // NOLINT: allocators convert

    T* allocate(std::size_t count) { return allocateLarge<T>(count).release(); }
    void deallocate(T* block, std::size_t) noexcept { FreeLarge()(block); }

    template <typename U>
    void construct(U* at) noexcept(std::is_nothrow_default_constructible_v<U>) {
        ::new (static_cast<void*>(at)) U;
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

}  // namespace shapedb
