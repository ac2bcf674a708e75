// The statements of the store. The address of a constant is its key in a connection's statement
// cache; a test checks the query plans of those that must be cheap.
#pragma once

namespace shapedb::store::sql {

// Columns 0 to 13 as `readShape` and `forEachShape` (rows.h) expect them: one row per metadata entry,
// so that a listing needs a single statement.
#define SHAPEDB_SHAPE_COLUMNS                                                             \
    "s.id, s.collection_id, s.key, s.version, s.points_version, s.state, s.point_count, " \
    "s.checksum, s.created_at, s.updated_at, s.failure_code, s.failure_message, m.name, m.value"
#define SHAPEDB_FROM_SHAPE " FROM shape s LEFT JOIN shape_metadata m ON m.shape_id = s.id "

// Collections.
inline constexpr char kCollectionByName[] =
    "SELECT id, name, description, parameters, generation, created_at FROM collection WHERE name = ?1";
inline constexpr char kCollectionById[] =
    "SELECT id, name, description, parameters, generation, created_at FROM collection WHERE id = ?1";
inline constexpr char kListCollections[] =
    "SELECT id, name, description, parameters, generation, created_at FROM collection ORDER BY name";
inline constexpr char kInsertCollection[] =
    "INSERT INTO collection (name, description, parameters, generation, created_at) VALUES (?1, ?2, ?3, 1, "
    "?4)";
inline constexpr char kDeleteCollection[] = "DELETE FROM collection WHERE id = ?1";

// Shapes.
inline constexpr char kShapeByKey[] =
    "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE "WHERE s.collection_id = ?1 AND s.key = ?2";
inline constexpr char kShapeById[] = "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE "WHERE s.id = ?1";
inline constexpr char kListShapes[] = "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE
                                      "WHERE s.collection_id = ?1 AND s.id > ?2 ORDER BY s.id";
inline constexpr char kListShapesInState[] =
    "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE
    "WHERE s.collection_id = ?1 AND s.id > ?2 AND s.state = ?3 ORDER BY s.id";
inline constexpr char kCountShapes[] = "SELECT count(*) FROM shape WHERE collection_id = ?1";
inline constexpr char kCountShapesInState[] =
    "SELECT count(*) FROM shape WHERE collection_id = ?1 AND state = ?2";
inline constexpr char kInsertShape[] =
    "INSERT INTO shape (collection_id, key, version, points_version, state, point_count, checksum, "
    "created_at, "
    "updated_at) VALUES (?1, ?2, 1, 1, 0, ?3, ?4, ?5, ?5)";
inline constexpr char kReplacePointsOfShape[] =
    "UPDATE shape SET version = version + 1, points_version = version + 1, state = 0, point_count = ?2, "
    "checksum = ?3, updated_at = ?4, failure_code = NULL, failure_message = NULL WHERE id = ?1";
inline constexpr char kRaiseVersion[] =
    "UPDATE shape SET version = version + 1, updated_at = ?2 WHERE id = ?1";
inline constexpr char kSetReady[] =
    "UPDATE shape SET state = 1, updated_at = ?2, failure_code = NULL, failure_message = NULL WHERE id = ?1";
inline constexpr char kSetFailed[] =
    "UPDATE shape SET state = 2, updated_at = ?2, failure_code = ?3, failure_message = ?4 WHERE id = ?1";
inline constexpr char kDeleteShape[] = "DELETE FROM shape WHERE id = ?1";
inline constexpr char kInsertMetadata[] =
    "INSERT INTO shape_metadata (shape_id, name, value) VALUES (?1, ?2, ?3)";
inline constexpr char kDeleteMetadata[] = "DELETE FROM shape_metadata WHERE shape_id = ?1";
inline constexpr char kInsertPoints[] =
    "INSERT INTO shape_points (shape_id, point_bytes, stored_bytes, points) VALUES (?1, ?2, ?3, ?4)";
inline constexpr char kDeletePoints[] = "DELETE FROM shape_points WHERE shape_id = ?1";
inline constexpr char kLoadPoints[] =
    "SELECT s.key, s.point_count, s.checksum, p.points FROM shape s "
    "LEFT JOIN shape_points p ON p.shape_id = s.id WHERE s.id = ?1";

// Signatures.
inline constexpr char kServingSignature[] =
    "SELECT s.key, s.state, s.failure_message, g.points_version, g.generation, g.digest, g.bytes "
    "FROM shape s JOIN collection c ON c.id = s.collection_id "
    "LEFT JOIN signature g ON g.shape_id = s.id AND g.generation = c.generation WHERE s.id = ?1";
inline constexpr char kPutSignature[] =
    "INSERT INTO signature (shape_id, generation, points_version, digest, bytes) VALUES (?1, ?2, ?3, ?4, ?5) "
    "ON CONFLICT (shape_id, generation) DO UPDATE SET points_version = excluded.points_version, "
    "digest = excluded.digest, bytes = excluded.bytes";
inline constexpr char kDeleteSignatures[] = "DELETE FROM signature WHERE shape_id = ?1";
inline constexpr char kDeleteSignature[] = "DELETE FROM signature WHERE shape_id = ?1 AND generation = ?2";
inline constexpr char kDeleteOtherSignatures[] =
    "DELETE FROM signature WHERE shape_id = ?1 AND generation <> ?2";
// Of table shape only the id, which the index by collection has: saves a look-up per shape.
inline constexpr char kLoadIndex[] =
    "SELECT s.id, m.name, m.value, g.points_version, g.generation, g.digest, "
    "g.bytes FROM shape s "
    "JOIN signature g ON g.shape_id = s.id AND g.generation = ?3 LEFT JOIN "
    "shape_metadata m ON m.shape_id = s.id "
    "WHERE s.collection_id = ?1 AND s.id > ?2 ORDER BY s.id";

// Jobs.
inline constexpr char kNextJob[] =
    "SELECT j.id, j.shape_id, s.collection_id, j.points_version, j.attempts, j.point_bytes, c.generation "
    "FROM job j JOIN shape s ON s.id = j.shape_id JOIN collection c ON c.id = s.collection_id "
    "WHERE j.state = 0 ORDER BY j.id LIMIT 1";
inline constexpr char kStartJob[] = "UPDATE job SET state = 1, attempts = attempts + 1 WHERE id = ?1";
inline constexpr char kInsertJob[] =
    "INSERT INTO job (shape_id, points_version, state, attempts, point_bytes, queued_at) VALUES (?1, ?2, 0, "
    "0, ?3, ?4)";
inline constexpr char kCurrentJob[] =
    "SELECT c.generation FROM job j JOIN shape s ON s.id = j.shape_id JOIN collection c ON c.id = "
    "s.collection_id "
    "WHERE j.id = ?1 AND j.shape_id = ?2 AND j.points_version = ?3 AND s.points_version = ?3";
inline constexpr char kReleaseJob[] =
    "UPDATE job SET state = 0, attempts = attempts - 1 WHERE id = ?1 AND state = 1 AND attempts = ?2";
inline constexpr char kDeleteJob[] = "DELETE FROM job WHERE shape_id = ?1";
inline constexpr char kRunningJobs[] =
    "SELECT shape_id, attempts FROM job WHERE state = 1 AND attempts >= ?1 ORDER BY id";
inline constexpr char kRequeueRunning[] = "UPDATE job SET state = 0 WHERE state = 1";
inline constexpr char kTally[] =
    "SELECT jobs, job_bytes, point_bytes, stored_point_bytes FROM tally WHERE id = 1";

// Rebuilds.
inline constexpr char kRebuildById[] =
    "SELECT id, collection_id, target_generation, parameters, state, done, failed, total, started_at, "
    "finished_at "
    "FROM rebuild WHERE id = ?1";
inline constexpr char kRunningRebuildOf[] = "SELECT id FROM rebuild WHERE collection_id = ?1 AND state = 0";
inline constexpr char kRunningRebuilds[] = "SELECT id FROM rebuild WHERE state = 0 ORDER BY id";
inline constexpr char kInsertRebuild[] =
    "INSERT INTO rebuild (collection_id, target_generation, parameters, state, done, failed, total, "
    "started_at, "
    "finished_at) VALUES (?1, ?2, ?3, 0, 0, 0, 0, ?4, 0)";
inline constexpr char kCountRebuilt[] =
    "SELECT count(*) FROM shape s JOIN signature g ON g.shape_id = s.id AND g.generation = ?2 WHERE "
    "s.collection_id = ?1";
inline constexpr char kCountRebuildFailures[] = "SELECT count(*) FROM rebuild_failure WHERE rebuild_id = ?1";
inline constexpr char kRebuildBatch[] =
    "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE
    "WHERE s.collection_id = ?1 AND s.id > ?2 "
    "AND NOT EXISTS (SELECT 1 FROM job j WHERE j.shape_id = s.id) "
    "AND NOT EXISTS (SELECT 1 FROM signature g WHERE g.shape_id = s.id AND g.generation = ?3) "
    "AND NOT EXISTS (SELECT 1 FROM rebuild_failure f WHERE f.rebuild_id = ?4 AND f.shape_id = s.id) ORDER BY "
    "s.id";
inline constexpr char kCurrentPoints[] =
    "SELECT 1 FROM shape WHERE id = ?1 AND collection_id = ?2 AND points_version = ?3";
inline constexpr char kPutRebuildFailure[] =
    "INSERT INTO rebuild_failure (rebuild_id, shape_id, points_version, code, message) VALUES (?1, ?2, ?3, "
    "?4, ?5) "
    "ON CONFLICT (rebuild_id, shape_id) DO UPDATE SET points_version = excluded.points_version, "
    "code = excluded.code, message = excluded.message";
inline constexpr char kDeleteRebuildFailure[] =
    "DELETE FROM rebuild_failure WHERE rebuild_id = ?1 AND shape_id = ?2";
inline constexpr char kDeleteRebuildFailuresOfShape[] = "DELETE FROM rebuild_failure WHERE shape_id = ?1";
inline constexpr char kDeleteRebuildFailures[] = "DELETE FROM rebuild_failure WHERE rebuild_id = ?1";
inline constexpr char kSetReadyRebuilt[] =
    "UPDATE shape SET state = 1, updated_at = ?3, failure_code = NULL, failure_message = NULL "
    "WHERE collection_id = ?1 AND state <> 1 AND NOT EXISTS (SELECT 1 FROM job j WHERE j.shape_id = "
    "shape.id) "
    "AND EXISTS (SELECT 1 FROM signature g WHERE g.shape_id = shape.id AND g.generation = ?2)";
inline constexpr char kSetFailedRebuilt[] =
    "UPDATE shape SET state = 2, updated_at = ?2, failure_code = f.code, failure_message = f.message "
    "FROM rebuild_failure f WHERE f.rebuild_id = ?1 AND f.shape_id = shape.id "
    "AND NOT EXISTS (SELECT 1 FROM job j WHERE j.shape_id = shape.id)";
inline constexpr char kSetGeneration[] =
    "UPDATE collection SET generation = ?2, parameters = ?3 WHERE id = ?1";
inline constexpr char kKeepOneGeneration[] =
    "DELETE FROM signature WHERE generation <> ?2 AND shape_id IN (SELECT id FROM shape WHERE collection_id "
    "= ?1)";
inline constexpr char kDropGeneration[] =
    "DELETE FROM signature WHERE generation = ?2 AND shape_id IN (SELECT id FROM shape WHERE collection_id = "
    "?1)";
inline constexpr char kEndRebuild[] =
    "UPDATE rebuild SET state = ?2, done = ?3, failed = ?4, total = ?5, finished_at = ?6 WHERE id = ?1";

// Statistics.
inline constexpr char kCountCollections[] = "SELECT count(*) FROM collection";
inline constexpr char kCountStates[] = "SELECT state, count(*) FROM shape GROUP BY state";
inline constexpr char kCountSignatures[] = "SELECT count(*) FROM signature";

}  // namespace shapedb::store::sql
