// SPDX-License-Identifier: GPL-3.0-or-later
// Statements of PostgreSQL: parameters and columns in the binary form of the types that the database has
// told.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/store/postgres/link.h"

namespace shapedb::store {

/// Prepares `text`, with parameters ?1, ?2, ..., under a name that the link does not use yet. The link must
/// outlive it. Throws Failure.
///
/// What may find many rows is read through a cursor, a few hundred rows at a time. What begins with COPY, as
/// "COPY (SELECT ...) TO STDOUT (FORMAT binary)", comes as a stream: no other statement may run before its
/// last row was read, or the rest is lost.
[[nodiscard]] std::unique_ptr<PreparedStatement> preparedStatement(PostgresLink& link,
                                                                   const std::string& name,
                                                                   const std::string& text);

/// `text` as a literal of SQL.
[[nodiscard]] std::string sqlLiteral(const std::string& text);

/// "1,2,3": for string_to_array, or between the parentheses of IN.
template <typename Numbers>
std::string listed(const Numbers& numbers) {
    std::string text;
    for (const auto number : numbers) text += (text.empty() ? "" : ",") + std::to_string(number);
    return text;
}

}  // namespace shapedb::store
