// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sql/table_copy.h"

#include <string>
#include <vector>

#include "server/store/point_blob.h"
#include "server/store/sql/collection_copy.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

namespace {

// A table: what reads it in order, what writes a row, and the type of each column: integer, real, text, blob.
// All but these four may be NULL where the database says so.
struct Table {
    const char* name;
    const char* read;
    const char* write;
    const char* types;
};

// After what they refer to. A new column of the schema belongs here too: a test compares.
#define TABLE(name, columns, key, places, types)                            \
    {                                                                       \
        name, "SELECT " columns " FROM " name " ORDER BY " key,             \
            "INSERT INTO " name " (" columns ") VALUES (" places ")", types \
    }
constexpr Table kTables[] = {
    TABLE("collection", "id, name, description, parameters, generation, created_at", "id",
          "?1, ?2, ?3, ?4, ?5, ?6", "itttii"),
    TABLE("collection_alias", "name, collection_id", "name", "?1, ?2", "ti"),
    TABLE("shape",
          "id, collection_id, key, version, points_version, state, point_count, checksum, created_at, "
          "updated_at, "
          "failure_code, failure_message, origin_x, origin_y, origin_z",
          "id", "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15", "iitiiiibiittrrr"),
    TABLE("shape_metadata", "shape_id, name, value", "shape_id, name", "?1, ?2, ?3", "itt"),
    TABLE("signature", "shape_id, generation, points_version, digest, bytes, views", "shape_id, generation",
          "?1, ?2, ?3, ?4, ?5, ?6", "iiiibb"),
    TABLE("shape_surface", "shape_id, points_version, digest, bytes", "shape_id", "?1, ?2, ?3, ?4", "iiib"),
    TABLE("rebuild",
          "id, collection_id, target_generation, parameters, state, done, failed, total, started_at, "
          "finished_at",
          "id", "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10", "iiitiiiiii"),
    TABLE("rebuild_failure", "rebuild_id, shape_id, points_version, code, message", "rebuild_id, shape_id",
          "?1, ?2, ?3, ?4, ?5", "iiitt"),
};
// As queued: a running one has an owner where several servers share a database.
constexpr Table kJobs =
    TABLE("job", "id, shape_id, points_version, state, attempts, point_bytes, queued_at, stops", "id",
          "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8", "iiiiiiii");
#undef TABLE

constexpr char kRunningJobsAsQueued[] =
    "SELECT id, shape_id, points_version, 0, CASE state WHEN 1 THEN attempts - 1 ELSE attempts END, "
    "point_bytes, "
    "queued_at, stops FROM job ORDER BY id";
constexpr char kShapesWithPoints[] = "SELECT shape_id FROM shape_points ORDER BY shape_id";
constexpr char kCountPoints[] = "SELECT count(*) FROM shape_points";

void bindColumn(Query& target, const Query& row, int column, char type) {
    const int position = column + 1;
    if (row.isNull(column)) return target.bindNullAt(position);
    switch (type) {
        case 'i': return target.bindAt(position, row.integer(column));
        case 'r': return target.bindAt(position, row.real(column));
        case 't': return target.bindAt(position, row.text(column));
        default: return target.bindAt(position, row.blob(column));
    }
}

void copyRows(Connection& source, Connection& target, const char* read, const Table& table,
              const RunContext& context) {
    Query row(source, read);
    while (row.step()) {
        orRaise(context.checkpoint());
        Query insert(target, table.write);
        for (int column = 0; table.types[column] != '\0'; ++column) {
            bindColumn(insert, row, column, table.types[column]);
        }
        insert.run();
    }
}

void copyPoints(Connection& source, Connection& target, const char* stage, const RunContext& context) {
    const auto total = static_cast<std::uint64_t>(numberOf(Query(source, kCountPoints)));
    std::uint64_t done = 0;
    Query shapes(source, kShapesWithPoints);
    while (shapes.step()) {
        orRaise(context.checkpoint());
        context.report(stage, done++, total);
        const std::int64_t shapeId = shapes.integer(0);
        Query points(source, sql::kStoredPoints, shapeId);
        if (!points.step()) continue;
        const std::string blob = bytesOf(points.blob(2));
        target.insertPoints(shapeId, static_cast<std::uint64_t>(points.integer(0)), sourceOf(blob));
    }
    context.report(stage, total, total);
}

}  // namespace

void copyAllTables(Connection& source, Connection& target, const char* stage, const RunContext& context) {
    for (const Table& table : kTables) copyRows(source, target, table.read, table, context);
    copyRows(source, target, kRunningJobsAsQueued, kJobs, context);
    copyPoints(source, target, stage, context);
}

}  // namespace shapedb::store
