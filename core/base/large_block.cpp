// SPDX-License-Identifier: Apache-2.0
#include "core/base/large_block.h"

#include <cstdint>
#include <cstdlib>

// Under AddressSanitizer everything comes from the heap, where it watches the borders of blocks.
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define SHAPEDB_HUGE_PAGES 1
#include <sys/mman.h>
#endif

namespace shapedb::large_block {

namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kPage = std::size_t{1} << 12;
constexpr std::size_t kHugePage = std::size_t{1} << 21;

std::size_t roundedUp(std::size_t bytes, std::size_t step) { return (bytes / step + 1) * step; }

#if defined(SHAPEDB_HUGE_PAGES)
void* mapped(std::size_t bytes) noexcept {
    void* block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return block == MAP_FAILED ? nullptr : block;
}

// Starts at a huge page. The last, partly used one is made of small pages.
void* onHugePages(std::size_t bytes) noexcept {
    auto* begin = static_cast<char*>(mapped(bytes + kHugePage));
    if (begin == nullptr) return nullptr;
    const std::size_t before = (kHugePage - reinterpret_cast<std::uintptr_t>(begin) % kHugePage) % kHugePage;
    if (before > 0) munmap(begin, before);
    if (before < kHugePage) munmap(begin + before + bytes, kHugePage - before);
    static_cast<void>(madvise(begin + before, bytes / kHugePage * kHugePage, MADV_HUGEPAGE));  // a hint
    return begin + before;
}
#endif

}  // namespace

void* allocate(std::size_t bytes) noexcept {
#if defined(SHAPEDB_HUGE_PAGES)
    if (bytes >= kMinHugePages) return onHugePages(roundedUp(bytes, kPage));
    if (bytes >= kMinMapped) return mapped(roundedUp(bytes, kPage));
#endif
    return std::aligned_alloc(kAlignment, roundedUp(bytes, kAlignment));
}

void release(void* block, std::size_t bytes) noexcept {
#if defined(SHAPEDB_HUGE_PAGES)
    if (bytes >= kMinMapped) {
        munmap(block, roundedUp(bytes, kPage));
        return;
    }
#endif
    static_cast<void>(bytes);
    std::free(block);
}

std::size_t movePages(void* from, std::size_t left, void* to, std::size_t bytes) noexcept {
#if defined(SHAPEDB_HUGE_PAGES)
    // A remainder stays: by its size release() tells mapped blocks from those of the heap.
    const std::size_t most = left < kMinMapped ? 0 : left - kMinMapped;
    const std::size_t length = (bytes < most ? bytes : most) / kHugePage * kHugePage;
    const bool movable =
        bytes >= kMinHugePages && length > 0 && reinterpret_cast<std::uintptr_t>(from) % kHugePage == 0;
    if (!movable) return 0;
    if (mremap(from, length, length, MREMAP_MAYMOVE | MREMAP_FIXED, to) != MAP_FAILED) return length;
    // mremap may have unmapped the target before it failed.
    if (mmap(to, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) ==
        MAP_FAILED) {
        std::abort();
    }
#else
    static_cast<void>(from);
    static_cast<void>(left);
    static_cast<void>(to);
    static_cast<void>(bytes);
#endif
    return 0;
}

}  // namespace shapedb::large_block
