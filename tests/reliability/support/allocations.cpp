#include "tests/reliability/support/allocations.h"

#include <cstdlib>
#include <new>

#include <sqlite3.h>

#include "tests/reliability/support/script.h"

namespace shapedb::reliability {

namespace {

bool watched = false;
bool goesOn = false;
bool hasFailed = false;
std::uint64_t failsAt = 0;
std::uint64_t counted = 0;

bool refused() {
    if (!watched || !InStore::now()) return false;
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
