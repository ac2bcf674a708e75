// SPDX-License-Identifier: GPL-3.0-or-later
// Store on SQLite: one database file in WAL mode.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/store/store.h"

namespace shapedb::store {

struct SqliteOptions {
    std::string path;               ///< database file; created when missing, its folder must exist
    int readers = 4;                ///< pooled read connections, 1 to 64
    int busyTimeoutMs = 5000;       ///< how long to wait for another process's lock
    int pointCompressionLevel = 1;  ///< zstd level of stored points, 1 to 19
    /// Source of timestamps; the system clock when empty (tests set it).
    std::function<TimestampMs()> now;
    /// What the parameters of a collection may be, which the store does not read: asked by `check`, and about
    /// files that are to be restored or imported. Empty accepts all.
    std::function<Result<void>(const std::string& parameters)> acceptParameters;
};

/// For a process with threads of different priority: SQLite keeps no count of its memory, for which every
/// allocation takes one lock. Call once, before any database is opened. False: it was too late.
bool stopCountingSqliteMemory() noexcept;

/// Opens the database and applies missing migrations, each in its own transaction. Only one store at
/// a time may have it open: an flock on `path`.lock is held until the store is destroyed, which no
/// call may outlive.
///
/// Errors: kStorage (cannot be opened or created; a symbolic link; in use: names the process), kStorageFull,
/// kSchemaTooNew, kDataLoss (not a ShapeDB database, damaged, empty, or only its log is there: says
/// what to do), kInvalidArgument.
[[nodiscard]] Result<std::unique_ptr<Store>> openSqliteStore(const SqliteOptions& options);

}  // namespace shapedb::store
