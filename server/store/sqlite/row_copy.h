// SPDX-License-Identifier: GPL-3.0-or-later
// A copy of a database whose indices are damaged. SQLite cannot mend one in place: REINDEX, DROP INDEX and
// VACUUM read each page of the old one first. Functions throw Failure.
#pragma once

#include <string>

#include "core/base/run_context.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::store {

/// Copies the rows of all tables of the database `from`, which has the schema of this program, into the empty
/// file `to`, and makes the indices from them. False, leaving anything in the file, if the tables are damaged
/// themselves. Reports the stage "backup" in tables. Throws Failure kCancelled, kDeadlineExceeded.
[[nodiscard]] bool copyRows(const std::string& from, const std::string& to, const SqliteOptions& options,
                            const RunContext& context);

}  // namespace shapedb::store
