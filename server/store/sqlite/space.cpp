// SPDX-License-Identifier: GPL-3.0-or-later
// What frees space, and what a full disk still allows.
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

/// How long a write on a full disk waits for reads that need the log.
constexpr int kEmptyLogWaitMs = 500;

}  // namespace

Result<void> SqliteStore::requireSpace() noexcept {
    const auto held = reserve_.hold();
    if (!held && held.error().code == ErrorCode::kStorageFull && hasFreePages()) return {};
    return held;
}

bool SqliteStore::hasFreePages() noexcept {
    const auto free = read("count the free pages", [](Connection& connection) {
        return ours(connection).integer("PRAGMA freelist_count") * kPageSize;
    });
    return free && static_cast<std::uint64_t>(*free) >= SpaceReserve::kBytes;
}

void SqliteStore::emptyLog() noexcept {
    // What was written is done; the log goes with a later one.
    static_cast<void>(guarded("write back the log", [&] {
        const std::lock_guard<std::mutex> lock(writerMutex_);
        static_cast<void>(writer_->truncateWal(longReads_ > 0 ? 0 : kEmptyLogWaitMs));
    }));
}

}  // namespace shapedb::store
