// SPDX-License-Identifier: GPL-3.0-or-later
// Which parts of a damaged database can still be read, and what is reported of the others.
//
// SQLite says that a page is malformed, but not of which table it is. The small tables, of which everything
// else depends, are therefore checked when the database is opened; the large ones are read by the index,
// which marks the collections it cannot read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/store/sqlite/connection.h"
#include "server/store/store.h"

namespace shapedb::store {

/// In a line of SQLite's integrity check: a page that it could not read, whatever the reason.
inline constexpr char kMissingPage[] = "failed to get page";

/// A line of SQLite's integrity check that tells of a page the device did not give, which is no damage: the
/// next time it may be there. Throws Failure kStorage (or std::bad_alloc) for such a line.
void raiseUnreadable(const std::string& line);

/// Reads the small tables. One line for each that is damaged: its name, what does not work without it, and
/// what to do. `queue` becomes that of the table of jobs. Throws Failure if they cannot be read for another
/// reason.
std::vector<std::string> damagedTables(SqliteConnection& connection, std::optional<std::string>& queue);

/// The collections, by name, when `listing` them has failed: those that can be read, and with
/// Collection::damage those of which only the id is known, and the name if an index still tells it. Throws
/// Failure other than kDataLoss.
std::vector<Collection> salvageCollections(SqliteConnection& connection, const Error& listing);

/// The aliases, by name, from the index over them: when their table cannot be read. Throws Failure.
std::vector<Alias> salvageAliases(SqliteConnection& connection);

/// Runs `body`; damage that it meets is left to others to tell of. Returns whether there was none; `damage`,
/// unless null, becomes what it was.
template <typename Body>
bool unlessDamaged(Body body, std::string* damage = nullptr) {
    try {
        body();
        return true;
    } catch (const Failure& failure) {
        if (failure.error.code != ErrorCode::kDataLoss) throw;
        if (damage != nullptr) *damage = failure.error.message;
        return false;
    }
}

}  // namespace shapedb::store
