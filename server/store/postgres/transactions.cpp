// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/transactions.h"

namespace shapedb::store {

namespace {

/// Times that a write which met another one is done again.
constexpr int kMostConflicts = 10;

}  // namespace

void inWriteTransaction(PostgresPool& pool, bool once, const std::function<void(Connection&)>& work) {
    for (int tries = 1;; ++tries) {
        const PostgresPool::Lease connection = pool.acquire();
        bool mayBeStored = false;
        try {
            Transaction transaction(*connection, Transaction::Kind::kWrite);
            work(*connection);
            mayBeStored = true;
            transaction.commit();
            return;
        } catch (const Failure& failure) {
            if (once) throw;
            // A connection that broke while nobody used it is found by the next one who does.
            const bool isStale = !mayBeStored && tries == 1 && connection->isBroken();
            if (isStale) pool.closeIdle();
            if (!isStale && !(isConflict(failure) && tries < kMostConflicts)) throw;
        }
    }
}

void inReadTransaction(PostgresPool& pool, const std::function<void(Connection&)>& work) {
    for (int tries = 1;; ++tries) {
        const PostgresPool::Lease connection = pool.acquire();
        try {
            const Transaction snapshot(*connection, Transaction::Kind::kRead);
            return work(*connection);
        } catch (const Failure&) {
            if (tries > 1 || !connection->isBroken()) throw;
            pool.closeIdle();
        }
    }
}

}  // namespace shapedb::store
