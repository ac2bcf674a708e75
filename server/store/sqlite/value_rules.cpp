// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/value_rules.h"

#include <iterator>
#include <optional>
#include <vector>

#include "common/safe_text.h"
#include "server/store/key_rules.h"
#include "server/store/sql/sql.h"
#include "server/store/sqlite/sequences.h"

namespace shapedb::store {

namespace {

/// Stands for ValueRules::mostCounted.
constexpr std::int64_t kCounted = -1;
/// Messages of failures name keys and parameters, and have their length.
constexpr std::size_t kMaxMessageBytes = 65'536;
/// Of a value in a line.
constexpr std::size_t kShownBytes = 100;

std::optional<std::string> problemOfStoredName(const std::string& name) {
    return sql::isHidden(name) ? std::nullopt : problemOfCollectionName(name);
}

std::optional<std::string> problemOfMessage(const std::string& message) {
    if (message.size() > kMaxMessageBytes) {
        return std::to_string(message.size()) + " bytes, at most " + std::to_string(kMaxMessageBytes) +
               " are allowed";
    }
    if (!isUtf8(message)) return "not valid UTF-8";
    return std::nullopt;
}

std::optional<std::string> problemOfFailureCode(const std::string& code) {
    if (code == errorCodeName(errorCodeFromName(code))) return std::nullopt;
    return "no error has this name";
}

using TextRule = std::optional<std::string> (*)(const std::string&);

struct Column {
    const char* name;
    enum class Kind { kText, kWhole, kParameters } kind;
    TextRule text;  ///< of kText
    std::int64_t least;
    std::int64_t most;
};

constexpr Column textColumn(const char* name, TextRule rule) {
    return {name, Column::Kind::kText, rule, 0, 0};
}
constexpr Column wholeColumn(const char* name, std::int64_t least, std::int64_t most) {
    return {name, Column::Kind::kWhole, nullptr, least, most};
}
constexpr Column countedColumn(const char* name, std::int64_t least) {
    return wholeColumn(name, least, kCounted);
}
constexpr Column momentColumn(const char* name) { return wholeColumn(name, 0, kLastMoment); }
constexpr Column parametersColumn(const char* name) {
    return {name, Column::Kind::kParameters, nullptr, 0, 0};
}

constexpr Column kOfCollections[] = {
    countedColumn("id", 1),         textColumn("name", &problemOfStoredName),
    countedColumn("generation", 1), textColumn("description", &problemOfDescription),
    momentColumn("created_at"),     parametersColumn("parameters")};
constexpr Column kOfAliases[] = {textColumn("name", &problemOfCollectionName)};
constexpr Column kOfRebuilds[] = {countedColumn("id", 1),     countedColumn("target_generation", 2),
                                  wholeColumn("state", 0, 3), countedColumn("done", 0),
                                  countedColumn("failed", 0), countedColumn("total", 0),
                                  momentColumn("started_at"), momentColumn("finished_at")};
constexpr Column kOfRunningRebuilds[] = {parametersColumn("parameters")};
constexpr Column kOfTally[] = {countedColumn("commits", 0)};
constexpr Column kOfNotices[] = {countedColumn("id", 1), momentColumn("noticed_at"),
                                 countedColumn("missing", 0), textColumn("message", &problemOfMessage)};
constexpr Column kOfShapes[] = {countedColumn("id", 1),
                                textColumn("key", &problemOfKey),
                                countedColumn("version", 1),
                                countedColumn("points_version", 1),
                                wholeColumn("state", 0, 2),
                                countedColumn("point_count", 0),
                                momentColumn("created_at"),
                                momentColumn("updated_at"),
                                textColumn("failure_code", &problemOfFailureCode),
                                textColumn("failure_message", &problemOfMessage)};
constexpr Column kOfMetadata[] = {textColumn("name", &problemOfMetadataKey),
                                  textColumn("value", &problemOfMetadataValue)};
constexpr Column kOfJobs[] = {countedColumn("id", 1),     countedColumn("points_version", 1),
                              wholeColumn("state", 0, 1), countedColumn("attempts", 0),
                              countedColumn("stops", 0),  countedColumn("point_bytes", 0),
                              momentColumn("queued_at")};
constexpr Column kOfRebuildFailures[] = {countedColumn("points_version", 1),
                                         textColumn("code", &problemOfFailureCode),
                                         textColumn("message", &problemOfMessage)};
constexpr Column kOfSignatures[] = {countedColumn("generation", 1), countedColumn("points_version", 1)};
constexpr Column kOfSurfaces[] = {countedColumn("points_version", 1)};
constexpr Column kOfDeleted[] = {countedColumn("id", 1),
                                 countedColumn("shape_id", 1),
                                 textColumn("key", &problemOfKey),
                                 countedColumn("version", 1),
                                 countedColumn("points_version", 1),
                                 wholeColumn("state", 0, 2),
                                 countedColumn("point_count", 0),
                                 momentColumn("created_at"),
                                 momentColumn("updated_at"),
                                 textColumn("failure_code", &problemOfFailureCode),
                                 textColumn("failure_message", &problemOfMessage)};

/// The statement returns what names the row, and the columns in their order.
struct ValueTable {
    const char* name;
    const char* sql;
    const Column* columns;
    std::size_t count;
};

constexpr ValueTable kEachTable[] = {
    {"collection", "SELECT id, id, name, generation, description, created_at, parameters FROM collection",
     kOfCollections, std::size(kOfCollections)},
    {"collection_alias", "SELECT collection_id, name FROM collection_alias", kOfAliases,
     std::size(kOfAliases)},
    {"rebuild",
     "SELECT id, id, target_generation, state, done, failed, total, started_at, finished_at FROM rebuild",
     kOfRebuilds, std::size(kOfRebuilds)},
    {"rebuild", "SELECT id, parameters FROM rebuild WHERE state = 0", kOfRunningRebuilds,
     std::size(kOfRunningRebuilds)},
    {"tally", "SELECT id, commits FROM tally", kOfTally, std::size(kOfTally)},
    {"notice", "SELECT id, id, noticed_at, missing, message FROM notice", kOfNotices, std::size(kOfNotices)},
    {"shape",
     "SELECT id, id, key, version, points_version, state, point_count, created_at, updated_at, failure_code, "
     "failure_message FROM shape",
     kOfShapes, std::size(kOfShapes)},
    {"shape_metadata", "SELECT shape_id, name, value FROM shape_metadata", kOfMetadata,
     std::size(kOfMetadata)},
    {"job", "SELECT id, id, points_version, state, attempts, stops, point_bytes, queued_at FROM job", kOfJobs,
     std::size(kOfJobs)},
    {"rebuild_failure", "SELECT shape_id, points_version, code, message FROM rebuild_failure",
     kOfRebuildFailures, std::size(kOfRebuildFailures)},
    {"signature", "SELECT shape_id, generation, points_version FROM signature", kOfSignatures,
     std::size(kOfSignatures)},
    {"shape_surface", "SELECT shape_id, points_version FROM shape_surface", kOfSurfaces,
     std::size(kOfSurfaces)},
    {"deleted_shape",
     "SELECT id, id, shape_id, key, version, points_version, state, point_count, created_at, updated_at, "
     "failure_code, failure_message FROM deleted_shape",
     kOfDeleted, std::size(kOfDeleted)},
    {"deleted_shape",
     "SELECT d.id, m.key, m.value FROM deleted_shape d JOIN json_each(CASE WHEN json_valid(d.metadata) THEN "
     "d.metadata ELSE '{\"not JSON\":0}' END) m",
     kOfMetadata, std::size(kOfMetadata)},
};
static_assert(std::size(kEachTable) == kValueTables);

/// Empty if the value is as it should be.
std::optional<std::string> problemOf(const Query& row, int at, const Column& column,
                                     const ValueRules& rules) {
    if (row.isNull(at)) return std::nullopt;  // where that is not allowed, SQLite's check tells of it
    switch (column.kind) {
        case Column::Kind::kText: return column.text(row.text(at));
        case Column::Kind::kParameters: {
            if (!rules.acceptParameters) return std::nullopt;
            const auto accepted = rules.acceptParameters(row.text(at));
            return accepted ? std::nullopt : std::optional<std::string>(accepted.error().message);
        }
        case Column::Kind::kWhole: break;
    }
    const std::int64_t most = column.most == kCounted ? rules.mostCounted : column.most;
    if (row.integer(at) >= column.least && row.integer(at) <= most) return std::nullopt;
    if (column.most != kCounted) {
        return "outside " + std::to_string(column.least) + " to " + std::to_string(most);
    }
    return "outside " + std::to_string(column.least) + " to " + asPower(most) +
           ", and there must be room to count on (to 2^62)";
}

}  // namespace

void checkValues(SqliteConnection& connection, std::size_t table, const ValueRules& rules,
                 const RunContext& context, const ReportProblem& report) {
    const ValueTable& wanted = kEachTable[table];
    Query row(connection, wanted.sql);
    while (row.step()) {
        orRaise(context.checkpoint());
        for (std::size_t i = 0; i < wanted.count; ++i) {
            const int at = static_cast<int>(i) + 1;
            const Column& column = wanted.columns[i];
            const auto problem = problemOf(row, at, column, rules);
            if (!problem) continue;
            report(escapeUnsafe("table " + std::string(wanted.name) + ", row " + row.text(0) + " has a " +
                                column.name + " that is none, " + quoted(cutText(row.text(at), kShownBytes)) +
                                ": " + *problem));
        }
    }
}

std::string asPower(std::int64_t powerOfTwo) {
    int exponent = 0;
    while (powerOfTwo > 1) {
        powerOfTwo >>= 1;
        ++exponent;
    }
    return "2^" + std::to_string(exponent);
}

}  // namespace shapedb::store
