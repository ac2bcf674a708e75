// The one implementation of Store: an SQLite database file in WAL mode.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/store/store.h"

namespace shapedb::store {

struct SqliteOptions {
    std::string path;               ///< database file; created when missing (its folder must exist)
    int readers = 4;                ///< pooled read connections, 1 to 64
    int busyTimeoutMs = 5000;       ///< how long to wait for another process's lock
    int pointCompressionLevel = 1;  ///< zstd level of stored points, 1 to 19
    /// Source of timestamps; the system clock when empty (tests set it).
    std::function<TimestampMs()> now;
};

/// Opens the database and brings its schema up to date (migrations/, each in its own
/// transaction). Only one process may have it open: a lock file beside it is held.
///
/// Errors: kStorage (cannot be opened or created, locked by another process: the message
/// says by what), kSchemaTooNew, kDataLoss (not a database, damaged), kInvalidArgument.
[[nodiscard]] Result<std::unique_ptr<Store>> openSqliteStore(const SqliteOptions& options);

}  // namespace shapedb::store
