// SPDX-License-Identifier: GPL-3.0-or-later
// What each column of a database may hold. A file that somebody made can hold anything that its types allow;
// what a client could not have stored must not come in with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "core/base/run_context.h"
#include "server/store/sqlite/connection.h"

namespace shapedb::store {

struct ValueRules {
    /// The largest id, version, generation or count; a power of two, sequences.h.
    std::int64_t mostCounted = 0;
    /// As SqliteOptions::acceptParameters; null accepts all.
    std::function<Result<void>(const std::string&)> acceptParameters{};
};

using ReportProblem = std::function<void(std::string)>;

/// Tables with rules, from 0. Those below kSmallValueTables are small.
inline constexpr std::size_t kValueTables = 14;
inline constexpr std::size_t kSmallValueTables = 6;

/// Reads one of these tables and reports each value that breaks a rule, with its table, row and column. Names
/// and texts have the rules of key_rules.h. Throws Failure.
void checkValues(SqliteConnection& connection, std::size_t table, const ValueRules& rules,
                 const RunContext& context, const ReportProblem& report);

/// "2^60" for a power of two.
[[nodiscard]] std::string asPower(std::int64_t powerOfTwo);

}  // namespace shapedb::store
