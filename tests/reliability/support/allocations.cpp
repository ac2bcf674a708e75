// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/allocations.h"

#include <cstdlib>
#include <new>
#include <unordered_set>

#include <execinfo.h>
#include <sqlite3.h>

#include "tests/reliability/support/script.h"

namespace shapedb::reliability {

namespace {

bool watched = false;
bool goesOn = false;
bool hasFailed = false;
std::uint64_t failsAt = 0;
std::uint64_t counted = 0;

// As deep as the way out of an error may go.
constexpr int kFrames = 40;

/// The stacks met, while they are looked at. Allocates, and is not counted meanwhile.
struct Stacks {
    std::unordered_set<std::uint64_t> met;
    std::vector<std::uint64_t> firstAt;
    bool watched = false;

    void look(std::uint64_t at) {
        void* frames[kFrames];
        const int depth = backtrace(frames, kFrames);
        std::uint64_t hash = 0;
        for (int i = 0; i < depth; ++i)
            hash = (hash ^ reinterpret_cast<std::uint64_t>(frames[i])) * 0x9e3779b97f4a7c15;
        if (met.insert(hash ^ hash >> 32).second) firstAt.push_back(at);
    }
};

Stacks stacks;

bool refused() {
    if (!watched || !InStore::now()) return false;
    if (stacks.watched) {
        watched = false;
        stacks.look(counted + 1);
        watched = true;
    }
    if (++counted != failsAt && !(goesOn && hasFailed)) return false;
    hasFailed = true;
    return true;
}

sqlite3_mem_methods realMemory;

void* allocate(int size) { return refused() ? nullptr : realMemory.xMalloc(size); }
void* reallocate(void* old, int size) { return refused() ? nullptr : realMemory.xRealloc(old, size); }

// Before the first use of SQLite, which then keeps its allocator.
const int kConfigured = [] {
    sqlite3_config(SQLITE_CONFIG_GETMALLOC, &realMemory);
    sqlite3_mem_methods own = realMemory;
    own.xMalloc = allocate;
    own.xRealloc = reallocate;
    return sqlite3_config(SQLITE_CONFIG_MALLOC, &own);
}();

}  // namespace

void Allocations::arm(std::uint64_t at, bool lasting) {
    watched = kConfigured == SQLITE_OK;
    goesOn = lasting;
    hasFailed = false;
    failsAt = at;
    counted = 0;
}

void Allocations::disarm() { watched = false; }

bool Allocations::fired() { return hasFailed; }

std::uint64_t Allocations::calls() { return counted; }

void Allocations::watchStacks() {
    stacks = {};
    stacks.watched = true;
}

std::vector<std::uint64_t> Allocations::newStacks() {
    stacks.watched = false;
    return std::move(stacks.firstAt);
}

namespace {

void* newMemory(std::size_t size) {
    if (refused()) throw std::bad_alloc();
    void* const memory = std::malloc(size > 0 ? size : 1);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

}  // namespace

}  // namespace shapedb::reliability

void* operator new(std::size_t size) { return shapedb::reliability::newMemory(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
