// SPDX-License-Identifier: GPL-3.0-or-later
// The ids that AUTOINCREMENT gives out: never twice, and never to the end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/sqlite/connection.h"

namespace shapedb::store {

/// No id, version or generation is larger: counting from here on takes for ever. A larger one was not made by
/// a server, and one of 2^63 - 1 would make every insert fail.
constexpr std::int64_t kMostCounted = std::int64_t{1} << 61;
/// The same in a file that is to be restored or imported. Smaller, so that what was taken in can be counted
/// on and still be restored.
constexpr std::int64_t kMostCountedInFiles = std::int64_t{1} << 60;

/// The last id given out; 0 before the first. One beyond kMostCounted is not believed: then the largest id in
/// use.
std::int64_t lastId(SqliteConnection& connection, const std::string& table);
void setLastId(SqliteConnection& connection, const std::string& table, std::int64_t id);
/// Gives the rows of `table` the ids from `last` + 1 on, in the order of those that they had, which must all
/// be smaller.
void renumber(SqliteConnection& connection, const std::string& table, std::int64_t last);

/// Sets sequences beyond kMostCounted back to the largest id in use. Returns what was mended, one line each.
/// Throws Failure.
std::vector<std::string> mendSequences(SqliteConnection& connection);

/// Transactions that changed something, since the database was made. Throws Failure kDataLoss.
std::int64_t countCommits(SqliteConnection& connection);
/// Counts one more and returns how many there are with it. Throws Failure kDataLoss.
std::int64_t addCommit(SqliteConnection& connection);

}  // namespace shapedb::store
