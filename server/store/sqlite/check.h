// SPDX-License-Identifier: GPL-3.0-or-later
// The complete check of a database, for Store::check and before a restore.
#pragma once

#include <string>
#include <vector>

#include "core/base/run_context.h"
#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/value_rules.h"

namespace shapedb::store {

/// One line per problem; after two hundred, one that says there are more; empty when sound. Reads everything
/// in one snapshot.
/// Reports the stages "integrity" and "points" (in shapes). Damage is a line, not a Failure; throws
/// Failure kCancelled, kDeadlineExceeded, or when it cannot read.
std::vector<std::string> checkDatabase(SqliteConnection& connection, const ValueRules& values,
                                       const RunContext& context);

}  // namespace shapedb::store
