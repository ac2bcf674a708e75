// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/files.h"

#include <memory>
#include <sstream>
#include <vector>

#include <sqlite3.h>

#include "common/sha256.h"

namespace shapedb::reliability {

namespace {

constexpr int kLong = 40;  // bytes

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

std::string valueOf(sqlite3_stmt* row, int column) {
    const int type = sqlite3_column_type(row, column);
    if (type == SQLITE_NULL) return "NULL";
    const auto* data = static_cast<const char*>(sqlite3_column_blob(row, column));
    const int size = sqlite3_column_bytes(row, column);
    const std::string bytes(data != nullptr ? data : "", static_cast<std::size_t>(size));
    if (type == SQLITE_BLOB || size > kLong) return toHex(sha256(bytes.data(), bytes.size()));
    return bytes;
}

/// One line for each row; false when reading failed.
bool addRows(sqlite3* database, const std::string& sql, const std::string& head, std::string& text) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(database, sql.c_str(), -1, &raw, nullptr) != SQLITE_OK) return false;
    const Statement statement(raw, sqlite3_finalize);
    int code = sqlite3_step(raw);
    for (; code == SQLITE_ROW; code = sqlite3_step(raw)) {
        text += head;
        for (int column = 0; column < sqlite3_column_count(raw); ++column)
            text += (column > 0 ? "|" : "") + valueOf(raw, column);
        text += '\n';
    }
    return code == SQLITE_DONE;
}

}  // namespace

std::string dumpDatabase(const std::string& path) {
    sqlite3* raw = nullptr;
    const int code = sqlite3_open_v2(path.c_str(), &raw, SQLITE_OPEN_READONLY, nullptr);
    const Database database(raw, sqlite3_close);
    std::string tables;
    if (code != SQLITE_OK || sqlite3_exec(raw, "BEGIN", nullptr, nullptr, nullptr) != SQLITE_OK ||
        !addRows(raw, "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name", "", tables))
        return std::string("cannot read: ") + sqlite3_errmsg(raw);
    std::string text;
    std::istringstream names(tables);
    for (std::string table; std::getline(names, table);) {
        if (!addRows(raw, "SELECT * FROM " + table + " ORDER BY 1, 2", table + ": ", text))
            return std::string("cannot read: ") + sqlite3_errmsg(raw);
    }
    return text;
}

std::string differenceOf(const std::string& actual, const std::string& expected) {
    std::istringstream a(actual);
    std::istringstream b(expected);
    for (std::string left, right; a || b;) {
        if (!std::getline(a, left)) left = "(end)";
        if (!std::getline(b, right)) right = "(end)";
        if (left != right) return "found:    " + left + "\nexpected: " + right;
    }
    return "no difference";
}

}  // namespace shapedb::reliability
