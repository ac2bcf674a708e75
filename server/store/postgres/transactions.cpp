// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/transactions.h"

#include <algorithm>
#include <chrono>

namespace shapedb::store {

namespace {

/// Times that a write which met another one is done again.
constexpr int kMostConflicts = 10;

/// A connection that broke while nobody used it is found by the next one who does, and another one is worth a
/// try. Not where the caller has waited as long as it may already.
bool wentStale(const PostgresConnection& connection) {
    return connection.isBroken() && !connection.hasTimedOut();
}

/// How long a write waits for a lock before others get its connection and it queues again: those who wait for
/// one long transaction would have all connections, and writes to other collections none.
std::chrono::milliseconds lockTurn(const PostgresPool& pool) {
    return std::clamp(pool.patience() / 100, std::chrono::milliseconds(20), std::chrono::milliseconds(200));
}

}  // namespace

void inWriteTransaction(PostgresPool& pool, bool once, const std::function<void(Connection&)>& work) {
    const auto until = PostgresPool::Clock::now() + pool.patience();
    for (int tries = 1;;) {
        const PostgresPool::Lease connection = pool.acquire(PostgresPool::Use::kWrite, until);
        connection->waitForLocks(once ? std::chrono::milliseconds(0) : lockTurn(pool));
        bool mayBeStored = false;
        try {
            Transaction transaction(*connection, Transaction::Kind::kWrite);
            work(*connection);
            mayBeStored = true;
            transaction.commit();
            return;
        } catch (const Failure& failure) {
            if (once) throw;
            if (connection->isBroken()) pool.closeIdle();
            if (isHeldUp(failure) && PostgresPool::Clock::now() < until) continue;
            const bool isStale = !mayBeStored && tries == 1 && wentStale(*connection);
            if (!isStale && !(isConflict(failure) && tries < kMostConflicts)) throw;
            ++tries;
        }
    }
}

void inReadTransaction(PostgresPool& pool, const std::function<void(Connection&)>& work) {
    for (int tries = 1;; ++tries) {
        const PostgresPool::Lease connection = pool.acquire(PostgresPool::Use::kRead);
        try {
            const Transaction snapshot(*connection, Transaction::Kind::kRead);
            return work(*connection);
        } catch (const Failure&) {
            if (connection->isBroken()) pool.closeIdle();
            if (tries > 1 || !wentStale(*connection)) throw;
        }
    }
}

}  // namespace shapedb::store
