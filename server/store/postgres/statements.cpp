// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/statements.h"

#include "server/store/postgres/statement.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

namespace {

// All pieces of a scan as one value, in their order.
#define SHAPEDB_ALL_CHUNKS                                                                            \
    "(SELECT string_agg(c.bytes, ''::bytea ORDER BY c.number) FROM point_chunk c WHERE c.shape_id = " \
    "p.shape_id)"

// Rows that another server is about to claim are passed over.
constexpr char kNextJob[] =
    "SELECT j.id, j.shape_id, s.collection_id, j.points_version, j.attempts, j.point_bytes, c.generation, "
    "j.stops "
    "FROM job j JOIN shape s ON s.id = j.shape_id JOIN collection c ON c.id = s.collection_id WHERE j.state "
    "= 0 AND "
    "NOT " SHAPEDB_HIDDEN("c.name") " ORDER BY j.stops, j.id LIMIT 1 FOR UPDATE OF j SKIP LOCKED";

constexpr char kRememberDeletion[] =
    "INSERT INTO deleted_shape (collection_id, key, shape_id, version, points_version, state, point_count, "
    "checksum, "
    "created_at, updated_at, failure_code, failure_message, origin_x, origin_y, origin_z, metadata) SELECT "
    "collection_id, key, id, version, points_version, state, point_count, checksum, created_at, updated_at, "
    "failure_code, failure_message, origin_x, origin_y, origin_z, coalesce((SELECT json_object_agg(name, "
    "encode(value, 'hex')) FROM shape_metadata WHERE shape_id = shape.id), '{}') FROM shape WHERE id = ?1 "
    "RETURNING "
    "id";

constexpr char kRememberedDeletion[] =
    "SELECT d.shape_id, d.collection_id, d.key, d.version, d.points_version, d.state, d.point_count, "
    "d.checksum, "
    "d.created_at, d.updated_at, d.failure_code, d.failure_message, d.origin_x, d.origin_y, d.origin_z, "
    "m.key, "
    "decode(m.value, 'hex') FROM deleted_shape d LEFT JOIN LATERAL json_each_text(d.metadata) m ON true "
    "WHERE d.id = "
    "(SELECT max(id) FROM deleted_shape WHERE collection_id = ?1 AND key = ?2 AND version = ?3)";

constexpr char kLoadPoints[] = "SELECT s.key, s.point_count, s.checksum, " SHAPEDB_ALL_CHUNKS
                               ", s.origin_x, s.origin_y, s.origin_z FROM shape s LEFT JOIN shape_points p "
                               "ON p.shape_id = s.id WHERE s.id = ?1";

constexpr char kStoredPoints[] =
    "SELECT p.point_bytes, p.stored_bytes, " SHAPEDB_ALL_CHUNKS " FROM shape_points p WHERE p.shape_id = ?1";

}  // namespace

StatementTexts postgresStatements(const std::string& serverName, std::chrono::milliseconds lease) {
    const std::string owner = sqlLiteral(serverName);
    const std::string end =
        "clock_timestamp() + interval '" + std::to_string(lease.count()) + " milliseconds'";
    return {
        {sql::kNextJob, kNextJob},
        {sql::kStartJob, "UPDATE job SET state = 1, attempts = attempts + 1, owner = " + owner +
                             ", lease_end = " + end + " WHERE id = ?1"},
        {sql::kReleaseJob,
         "UPDATE job SET state = 0, attempts = attempts - 1, owner = NULL, lease_end = NULL WHERE id = ?1 "
         "AND state "
         "= 1 AND attempts = ?2 AND owner = " +
             owner},
        {sql::kRequeueJob,
         "UPDATE job SET state = 0, attempts = ?2, stops = ?3, owner = NULL, lease_end = NULL WHERE shape_id "
         "= ?1"},
        {sql::kRunningJobs,
         "SELECT shape_id, points_version, attempts, stops FROM job WHERE state = 1 AND owner = " + owner},
        {sql::kRememberDeletion, kRememberDeletion},
        {sql::kRememberedDeletion, kRememberedDeletion},
        {sql::kLoadPoints, kLoadPoints},
        {sql::kStoredPoints, kStoredPoints},
    };
}

}  // namespace shapedb::store
