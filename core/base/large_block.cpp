#include "core/base/large_block.h"

#include <cstdint>
#include <cstdlib>

// Under AddressSanitizer everything comes from the heap, whose borders it watches.
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define SHAPEDB_LARGE_PAGES 1
#include <sys/mman.h>
#endif

namespace shapedb::large_block {

namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kPage = std::size_t{1} << 12;
constexpr std::size_t kLargePage = std::size_t{1} << 21;

std::size_t roundedUp(std::size_t bytes, std::size_t step) { return (bytes / step + 1) * step; }

#if defined(SHAPEDB_LARGE_PAGES)
void* mapped(std::size_t bytes) noexcept {
    void* block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return block == MAP_FAILED ? nullptr : block;
}

// From the beginning of a large page on. The last, partly used, is made of small ones.
void* onLargePages(std::size_t bytes) noexcept {
    auto* begin = static_cast<char*>(mapped(bytes + kLargePage));
    if (begin == nullptr) return nullptr;
    const std::size_t before =
        (kLargePage - reinterpret_cast<std::uintptr_t>(begin) % kLargePage) % kLargePage;
    if (before > 0) munmap(begin, before);
    if (before < kLargePage) munmap(begin + before + bytes, kLargePage - before);
    static_cast<void>(madvise(begin + before, bytes / kLargePage * kLargePage, MADV_HUGEPAGE));  // a wish
    return begin + before;
}
#endif

}  // namespace

void* take(std::size_t bytes) noexcept {
#if defined(SHAPEDB_LARGE_PAGES)
    if (bytes >= kLeastOnLargePages) return onLargePages(roundedUp(bytes, kPage));
    if (bytes >= kLeastMapped) return mapped(roundedUp(bytes, kPage));
#endif
    return std::aligned_alloc(kAlignment, roundedUp(bytes, kAlignment));
}

void give(void* block, std::size_t bytes) noexcept {
#if defined(SHAPEDB_LARGE_PAGES)
    if (bytes >= kLeastMapped) {
        munmap(block, roundedUp(bytes, kPage));
        return;
    }
#endif
    static_cast<void>(bytes);
    std::free(block);
}

std::size_t movePages(void* from, std::size_t left, void* to, std::size_t bytes) noexcept {
#if defined(SHAPEDB_LARGE_PAGES)
    // All but a remainder, which tells the system's own blocks from the heap's in give().
    const std::size_t most = left < kLeastMapped ? 0 : left - kLeastMapped;
    const std::size_t length = (bytes < most ? bytes : most) / kLargePage * kLargePage;
    const bool large =
        bytes >= kLeastOnLargePages && length > 0 && reinterpret_cast<std::uintptr_t>(from) % kLargePage == 0;
    if (!large) return 0;
    if (mremap(from, length, length, MREMAP_MAYMOVE | MREMAP_FIXED, to) != MAP_FAILED) return length;
    // What was there may be gone already.
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
