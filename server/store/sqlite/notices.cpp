// SPDX-License-Identifier: GPL-3.0-or-later
// What was found when the database was opened, and is told until an operator has acknowledged it.
#include <algorithm>

#include "server/store/failpoints.h"
#include "server/store/sql/rows.h"
#include "server/store/sqlite/sequences.h"
#include "server/store/sqlite/sqlite_sql.h"
#include "server/store/sqlite/sqlite_store_impl.h"
#include "server/store/sqlite/value_rules.h"

namespace shapedb::store {

namespace {

/// Starts that found something; older ones are forgotten.
constexpr std::int64_t kMostNotices = 100;

constexpr char kHowToAcknowledge[] = "; told until 'shapedb admin check --acknowledge'";

}  // namespace

void SqliteStore::compareCommits() {
    const std::int64_t commits = countCommits(*writer_);
    auto mark = mark_.read();
    if (mark.value_or(0) > kMostCounted) mark.reset();
    const auto notice = [&](std::int64_t missing, const std::string& message) {
        try {
            addNotice(missing, message);
        } catch (const Failure& failure) {
            if (failure.error.code != ErrorCode::kStorageFull) throw;
            findings_.push_back(message);  // told at least until the next start
        }
    };
    const std::int64_t missing = std::max<std::int64_t>(0, mark.value_or(0) - commits);
    if (missing > 0) {
        notice(missing,
               "the last " + std::to_string(missing) +
                   " acknowledged changes are missing: the write-ahead log was damaged or removed, or "
                   "an older copy of the database was put in its place; restore a backup, or send the "
                   "scans again");
    }
    // A file that was closed or is a backup, and was put into a new folder, has no mark.
    if (!mark && (wasOpen_ || (commits > 0 && lock_.wasComplete()))) {
        const std::string how = wasOpen_ ? ", and the last server did not close the database" : "";
        notice(
            0,
            "the file '" + options_.path +
                ".commits', which counts acknowledged changes outside the database, is missing or damaged" +
                how +
                ": changes may be missing, and nobody can tell; compare with what was sent last, or restore "
                "a "
                "backup");
    }
    SHAPEDB_FAILPOINT("open.counted");
    mark_.write(countCommits(*writer_));
    if (mark_.sync()) lock_.setComplete();
    readNotices();
}

void SqliteStore::addNotice(std::int64_t missing, const std::string& message) {
    Transaction transaction(*writer_, Transaction::Kind::kWrite);
    Query(*writer_, sqlite_sql::kAddNotice, now(), missing, message).run();
    Query(*writer_, sqlite_sql::kForgetNotices, writer_->lastInsertId() - kMostNotices).run();
    // Counted as any change: it is noticed if this one is lost.
    addCommit(*writer_);
    SHAPEDB_FAILPOINT("open.noticed");
    transaction.commit();
}

void SqliteStore::readNotices() {
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    missingCommits_ = 0;
    notices_.clear();
    Query query(*writer_, sqlite_sql::kListNotices);
    while (query.step()) {
        missingCommits_ += query.integer(0);
        notices_.push_back(query.text(1) + kHowToAcknowledge);
    }
}

void SqliteStore::checkSmallValues() {
    for (std::size_t table = 0; table < kSmallValueTables; ++table) {
        checkValues(*writer_, table, {kMostCounted, {}}, {},
                    [&](std::string problem) { findings_.push_back(std::move(problem)); });
    }
}

std::vector<std::string> SqliteStore::findings() const {
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    std::vector<std::string> all = findings_;
    all.insert(all.end(), notices_.begin(), notices_.end());
    return all;
}

std::size_t SqliteStore::notices() const {
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    return notices_.size();
}

Result<std::vector<std::string>> SqliteStore::acknowledge() {
    const auto done = write("acknowledge what was found", [](Connection& connection) {
        Query(connection, sqlite_sql::kAcknowledge).run();
    });
    if (!done) return fail(done.error());
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    missingCommits_ = 0;
    return std::exchange(notices_, {});
}

}  // namespace shapedb::store
