// SPDX-License-Identifier: GPL-3.0-or-later
// Copies the content of a whole database, row by row and with all ids, to one of another kind.
#pragma once

#include "core/base/run_context.h"
#include "server/store/sql/connection.h"

namespace shapedb::store {

/// In transactions of the caller. `target` must be empty; what counts its rows counts them as they come. Not
/// copied: what belongs to a database and not to its content (who runs a job, the log of changes, notices).
/// Reports `stage` in shapes. Throws Failure, also kCancelled and kDeadlineExceeded.
void copyAllTables(Connection& source, Connection& target, const char* stage, const RunContext& context);

}  // namespace shapedb::store
