// SPDX-License-Identifier: GPL-3.0-or-later
// Transactions on a connection of a pool, done again where the database or a connection was the reason.
#pragma once

#include <functional>

#include "server/store/postgres/pool.h"

namespace shapedb::store {

/// Commits what `work` does, unless it throws. Where another transaction was in the way, or the connection
/// had broken while nobody used it, all is done again, unless `once`. While another transaction keeps a lock,
/// it takes turns with others at the connections, until the pool's patience is over. Throws Failure and what
/// the work throws.
void inWriteTransaction(PostgresPool& pool, bool once, const std::function<void(Connection&)>& work);

/// All reads of `work` see one moment. Done again after a connection that had broken while nobody used it.
/// Throws Failure and what the work throws.
void inReadTransaction(PostgresPool& pool, const std::function<void(Connection&)>& work);

}  // namespace shapedb::store
