// SPDX-License-Identifier: GPL-3.0-or-later
// What frees space, and what a full disk still allows.
#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/sqlite/collection_copy.h"
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

/// How long a write on a full disk waits for reads that need the log.
constexpr int kEmptyLogWaitMs = 500;

std::optional<std::int64_t> firstId(Connection& connection, const char* statement) {
    Query query(connection, statement);
    if (!query.step()) return std::nullopt;
    return query.integer(0);
}

}  // namespace

Result<void> SqliteStore::requireSpace() noexcept {
    const auto held = reserve_.hold();
    if (!held && held.error().code == ErrorCode::kStorageFull && hasFreePages()) return {};
    return held;
}

bool SqliteStore::hasFreePages() noexcept {
    const auto free = read("count the free pages", [](Connection& connection) {
        return connection.integer("PRAGMA freelist_count") * kPageSize;
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

Result<void> SqliteStore::dropDeleted() noexcept {
    return dropHidden("remove what was deleted", sql::kSomeDeletedCollection);
}

Result<void> SqliteStore::dropHidden(const char* operation, const char* statement) noexcept {
    const auto there =
        read(operation, [&](Connection& connection) { return firstId(connection, statement).has_value(); });
    RETURN_IF_ERROR(there);
    if (!*there) return {};
    while (true) {
        const auto more = remove(operation, [&](Connection& connection) {
            const auto found = firstId(connection, statement);
            if (!found) return false;
            deleteSome(connection, *found);
            SHAPEDB_FAILPOINT("delete.some");
            return true;
        });
        RETURN_IF_ERROR(more);
        if (!*more) return {};
    }
}

}  // namespace shapedb::store
