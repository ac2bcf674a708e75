// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/connection.h"

#include <algorithm>
#include <utility>

#include <libpq-fe.h>

#include "server/store/postgres/statement.h"

namespace shapedb::store {

namespace {

/// The largest piece of a scan in one row.
constexpr std::size_t kChunkBytes = std::size_t{8} << 20;

constexpr char kInsertPoints[] =
    "INSERT INTO shape_points (shape_id, point_bytes, stored_bytes) VALUES (?1, ?2, ?3)";
constexpr char kInsertChunk[] = "INSERT INTO point_chunk (shape_id, number, bytes) VALUES (?1, ?2, ?3)";
constexpr char kBeginRead[] = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY";
constexpr char kBeginWrite[] = "BEGIN ISOLATION LEVEL READ COMMITTED READ WRITE";

}  // namespace

void PostgresConnection::execute(const std::string& sql) { link_.query(sql); }

std::string PostgresConnection::text(const std::string& sql) {
    const PostgresResult rows = link_.query(sql);
    if (PQntuples(rows.get()) == 0 || PQgetisnull(rows.get(), 0, 0) != 0) return {};
    return PQgetvalue(rows.get(), 0, 0);
}

PreparedStatement& PostgresConnection::prepared(const char* sql) {
    const auto found = statements_.find(sql);
    if (found != statements_.end()) return *found->second;
    const auto own = texts_.find(sql);
    auto statement =
        preparedStatement(link_, "s" + std::to_string(++names_), own != texts_.end() ? own->second : sql);
    return *statements_.emplace(sql, std::move(statement)).first->second;
}

void PostgresConnection::beginRead() { execute(kBeginRead); }

void PostgresConnection::beginWrite() {
    std::string begin = kBeginWrite;
    if (lockPatience_.count() > 0)
        begin += "; SET LOCAL lock_timeout = " + std::to_string(lockPatience_.count());
    execute(begin);
}

void PostgresConnection::commit() {
    // The database would answer a COMMIT after an error by undoing all, without a word.
    if (!link_.isInTransaction()) {
        raise(ErrorCode::kInternal, "a transaction that failed is committed");
    }
    try {
        execute("COMMIT");
    } catch (const Failure& failure) {
        if (!isBroken()) throw;
        raise(ErrorCode::kUnavailable,
              "the connection to the database was lost while a change was being stored: it may or may not be "
              "stored; look before you send it again (" +
                  failure.error.message + ")");
    }
}

void PostgresConnection::rollback() noexcept {
    if (isBroken() || link_.isIdle()) return;
    static_cast<void>(guarded("roll back", [&] { execute("ROLLBACK"); }));
}

void PostgresConnection::insertPoints(std::int64_t shapeId, std::uint64_t pointBytes,
                                      const BlobSource& blob) {
    Query(*this, kInsertPoints, shapeId, pointBytes, blob.size).run();
    std::int64_t number = 0;
    const auto insert = [&](const char* data, std::size_t size) {
        for (std::size_t at = 0; at < size; at += kChunkBytes) {
            const BlobView chunk{data + at, std::min(kChunkBytes, size - at)};
            Query(*this, kInsertChunk, shapeId, number++, chunk).run();
        }
    };
    if (blob.whole != nullptr) return insert(blob.whole->data(), blob.whole->size());
    std::string pending;
    blob.write([&](const void* data, std::size_t size) {
        pending.append(static_cast<const char*>(data), size);
        if (pending.size() < kChunkBytes) return;
        const std::size_t whole = pending.size() / kChunkBytes * kChunkBytes;
        insert(pending.data(), whole);
        pending.erase(0, whole);
    });
    insert(pending.data(), pending.size());
}

}  // namespace shapedb::store
