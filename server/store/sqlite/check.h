// The thorough check of a database, used by Store::check and before a restore.
#pragma once

#include <string>
#include <vector>

#include "core/base/run_context.h"
#include "server/store/sqlite/connection.h"

namespace shapedb::store {

/// One line per problem, at most some hundred; empty when sound. Reads everything in one
/// snapshot. Reports the stages "integrity" and "points" (in shapes). Throws Failure
/// kCancelled, kDeadlineExceeded, or when it cannot read; damage is a line, not a Failure.
std::vector<std::string> checkDatabase(Connection& connection, const RunContext& context);

}  // namespace shapedb::store
