// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/check.h"

#include <algorithm>
#include <cmath>

#include "common/safe_text.h"
#include "core/geometry/box.h"
#include "core/preparation/frame.h"
#include "server/store/key_rules.h"
#include "server/store/sql/rows.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/sequences.h"
#include "server/store/verified_scan.h"

namespace shapedb::store {

namespace {

constexpr std::size_t kMaxProblems = 200;

constexpr char kIntegrity[] = "PRAGMA integrity_check(100)";
constexpr char kForeignKeys[] = "PRAGMA foreign_key_check";
constexpr char kTallyProblems[] =
    "SELECT 1 FROM (SELECT 1) LEFT JOIN tally t ON t.id = 1 WHERE t.id IS NULL "
    "OR t.jobs <> (SELECT count(*) FROM job) OR t.job_bytes <> (SELECT total(point_bytes) FROM "
    "job) "
    "OR t.point_bytes <> (SELECT total(point_bytes) FROM shape_points) "
    "OR t.stored_point_bytes <> (SELECT total(stored_bytes) FROM shape_points)";
constexpr char kAllPoints[] =
    "SELECT s.key, s.point_count, s.checksum, p.points, p.point_bytes, p.stored_bytes, s.origin_x, "
    "s.origin_y, "
    "s.origin_z FROM shape s LEFT JOIN shape_points p ON p.shape_id = s.id ORDER BY s.id";
constexpr char kAllSignatures[] =
    "SELECT g.shape_id, g.points_version, g.generation, g.digest, g.bytes, g.views FROM signature g "
    "JOIN shape s ON s.id = g.shape_id";
constexpr char kAllSurfaces[] =
    "SELECT s.key, f.points_version, f.digest, f.bytes FROM shape_surface f JOIN shape s ON s.id = "
    "f.shape_id";
constexpr char kShapesTotal[] = "SELECT count(*) FROM shape";

/// A rule between tables; the statement lists the keys of shapes that break it.
struct Rule {
    const char* sql;
    const char* problem;
};
constexpr char kSequenceProblems[] =
    "SELECT name, seq FROM sqlite_sequence WHERE typeof(seq) <> 'integer' OR seq < 0 OR seq > ?1";
/// The same for other tables; the statement names the row.
constexpr Rule kRulesOfOthers[] = {
    {"SELECT 'alias ''' || a.name || '''' FROM collection_alias a JOIN collection c ON c.name = a.name",
     "is also the name of a collection"},
    {"SELECT 'table collection, row ' || c.id FROM collection c WHERE c.waiting <> (SELECT count(*) FROM "
     "shape "
     "s WHERE s.collection_id = c.id AND s.state = 0 AND NOT EXISTS (SELECT 1 FROM signature g WHERE "
     "g.shape_id "
     "= s.id AND g.generation = c.generation))",
     "has a wrong count of waiting shapes"},
    {"SELECT 'table rebuild, row ' || r.id FROM rebuild r JOIN collection c ON c.id = r.collection_id WHERE "
     "r.state = 0 AND r.target_generation <> c.generation + 1",
     "runs into a generation that is not the next one of its collection"},
    {"SELECT 'table deleted_shape, row ' || id FROM deleted_shape WHERE (max(abs(origin_x), "
     "abs(origin_y), "
     "abs(origin_z)) <= 3.4e38) IS NOT 1 OR length(checksum) <> 32 OR CASE WHEN json_valid(metadata) THEN "
     "json_type(metadata) <> 'object' ELSE 1 END",
     "has an origin, a checksum or metadata that is none"},
    {"SELECT 'table job, row ' || id FROM job WHERE state = 1 AND attempts < 1",
     "is running and was never tried"},
};
static_assert(kMaxMetadataEntries == 64, "as in the rule below");
constexpr Rule kRules[] = {
    {"SELECT s.key FROM shape s JOIN job j ON j.shape_id = s.id JOIN shape_points p ON p.shape_id = s.id "
     "WHERE "
     "j.point_bytes <> p.point_bytes",
     "has a job that counts other bytes than its points have"},
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id WHERE s.state = 1 AND NOT EXISTS "
     "(SELECT 1 FROM signature g WHERE g.shape_id = s.id AND g.generation = c.generation "
     "AND g.points_version = s.points_version)",
     "is ready but has no signature of its current points"},
    // An import queues its jobs when it is complete, and a deletion ends with what is left.
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id WHERE s.state = 0 AND "
     "NOT " SHAPEDB_HIDDEN("c.name") " AND NOT EXISTS (SELECT 1 FROM job j WHERE j.shape_id = s.id)",
     "is pending but has no job"},
    {"SELECT s.key FROM shape s JOIN job j ON j.shape_id = s.id WHERE s.state <> 0",
     "has a job but is not pending"},
    {"SELECT s.key FROM shape s JOIN job j ON j.shape_id = s.id WHERE j.points_version <> s.points_version",
     "has a job for points it no longer has"},
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id JOIN signature g ON g.shape_id = "
     "s.id "
     "WHERE g.points_version > s.points_version OR (g.generation <> c.generation AND NOT EXISTS "
     "(SELECT 1 FROM rebuild r WHERE r.collection_id = c.id AND r.state = 0 "
     "AND r.target_generation = g.generation AND g.points_version = s.points_version))",
     "has a signature that belongs to no generation"},
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id JOIN signature g ON g.shape_id = "
     "s.id "
     "WHERE s.state = 2 AND g.generation = c.generation",
     "has failed but still serves a signature"},
    {"SELECT s.key FROM shape s JOIN shape_surface f ON f.shape_id = s.id WHERE f.points_version > "
     "s.points_version",
     "has surface points of points that it never had"},
    // A read-only connection knows no CHECK constraints.
    {"SELECT key FROM shape WHERE points_version > version", "has points of a version that it never had"},
    {"SELECT key FROM shape WHERE (state = 2) <> (failure_code IS NOT NULL) OR (state = 2) <> "
     "(failure_message IS NOT NULL)",
     "has a failure that does not fit its state"},
    {"SELECT s.key FROM shape s JOIN (SELECT shape_id FROM shape_metadata GROUP BY shape_id HAVING count(*) "
     "> "
     "64) m ON m.shape_id = s.id",
     "has more than 64 entries of metadata"},
    // SQLite reads what is not a number as NULL.
    {"SELECT s.key FROM shape s WHERE (max(abs(s.origin_x), abs(s.origin_y), abs(s.origin_z)) <= 3.4e38) IS "
     "NOT 1",
     "has points relative to an origin that is out of range"},
};

class Checker {
  public:
    Checker(SqliteConnection& connection, const ValueRules& values, const RunContext& context)
        : connection_(connection), values_(values), context_(context) {}

    std::vector<std::string> run() {
        const Interruptible interruptible(connection_, context_);
        const Transaction snapshot(connection_, Transaction::Kind::kRead);
        context_.report("integrity", 0, 0);
        section([&] { integrity(); });
        section([&] { foreignKeys(); });
        section([&] { points(); });
        section([&] { signatures(); });
        section([&] { surfaces(); });
        for (const Rule& rule : kRules) {
            section([&] {
                Query query(connection_, rule.sql);
                while (query.step()) add("shape " + named(query) + " " + rule.problem);
            });
        }
        for (const Rule& rule : kRulesOfOthers) {
            section([&] {
                Query query(connection_, rule.sql);
                while (query.step()) add(escapeUnsafe(query.text(0)) + " " + rule.problem);
            });
        }
        section([&] { sequences(); });
        for (std::size_t table = 0; table < kValueTables; ++table) {
            section([&] {
                checkValues(connection_, table, values_, context_,
                            [&](std::string problem) { add(std::move(problem)); });
            });
        }
        section([&] {
            if (Query(connection_, kTallyProblems).step()) add("the sums in table tally are wrong");
        });
        return std::move(problems_);
    }

  private:
    void add(std::string problem) {
        if (problems_.size() < kMaxProblems) {
            problems_.push_back(std::move(problem));
        } else if (problems_.size() == kMaxProblems) {
            problems_.push_back("... and more");
        }
    }

    /// Damage ends a section, but not the check.
    template <typename Body>
    void section(Body body) {
        orRaise(context_.checkpoint());
        try {
            body();
        } catch (const Failure& failure) {
            orRaise(context_.checkpoint());  // reports the caller's reason instead of SQLite's "interrupted"
            if (failure.error.code != ErrorCode::kDataLoss) throw;
            add(failure.error.message);
        }
    }

    /// One damaged row is a problem to list. A failing database ends the section, and what says nothing of
    /// the row ends the check.
    template <typename Body>
    void row(Body body) {
        try {
            body();
        } catch (const Failure& failure) {
            if (failure.fromDatabase || failure.error.code == ErrorCode::kOutOfMemory) throw;
            add(failure.error.message);
        }
    }

    void integrity() {
        std::vector<std::string> lines = integrityLines();
        // SQLite also lists a page that it had no memory for as one that it did not get: a second look finds
        // it.
        const auto isMissing = [](const std::string& line) {
            return line.find(kMissingPage) != std::string::npos;
        };
        if (std::any_of(lines.begin(), lines.end(), isMissing)) lines = integrityLines();
        for (const std::string& line : lines) {
            raiseUnreadable(line);
            if (line != "ok") add("database integrity: " + line);
        }
    }

    std::vector<std::string> integrityLines() {
        std::vector<std::string> lines;
        Query query(connection_, kIntegrity);
        while (query.step()) lines.push_back(query.text(0));
        return lines;
    }

    static std::string named(const Query& query) { return quoted(escapeUnsafe(query.text(0))); }

    /// What counts up must never come to its end.
    void sequences() {
        Query query(connection_, kSequenceProblems, values_.mostCounted);
        while (query.step()) {
            add("table sqlite_sequence, row " + quoted(escapeUnsafe(query.text(0))) +
                ": the id sequence of table " + escapeUnsafe(query.text(0)) + " stands at " + query.text(1) +
                ", outside 0 to " + asPower(values_.mostCounted) + ": no room for more rows");
        }
    }

    void foreignKeys() {
        Query query(connection_, kForeignKeys);
        while (query.step())
            add("a row of " + query.text(0) + " refers to a missing row of " + query.text(2));
    }

    void points() {
        std::uint64_t total = 0;
        {
            Query query(connection_, kShapesTotal);
            if (query.step()) total = static_cast<std::uint64_t>(query.integer(0));
        }
        Query query(connection_, kAllPoints);
        for (std::uint64_t done = 0; query.step(); ++done) {
            orRaise(context_.checkpoint());
            context_.report("points", done, total);
            row([&] {
                const std::vector<float> loaded = readPoints(query);
                const auto bytes = static_cast<std::int64_t>(loaded.size() * sizeof(float));
                if (query.integer(4) != bytes ||
                    query.integer(5) != static_cast<std::int64_t>(query.blob(3).size)) {
                    add("shape " + quoted(query.text(0)) +
                        ": the stored byte counts do not match its points");
                }
                origin(query, loaded);
            });
        }
        context_.report("points", total, total);
    }

    /// Columns 6 to 8 of kAllPoints, beside the points. What is none at all is found by a rule.
    void origin(const Query& query, const std::vector<float>& points) {
        for (const int column : {6, 7, 8}) {
            if (query.isNull(column) || !(std::abs(query.real(column)) <= kMaxCoordinate)) return;
        }
        const Point3 origin{query.real(6), query.real(7), query.real(8)};
        if (origin == Point3{}) return;
        const auto placed = checkPlacement(boxOf(toCloud(points)), origin);
        if (!placed) add("shape " + named(query) + ": " + placed.error().message);
    }

    void signatures() {
        Query query(connection_, kAllSignatures);
        while (query.step()) {
            orRaise(context_.checkpoint());
            row([&] { readSignature(connection_, query, 1, query.integer(0)); });
        }
    }

    void surfaces() {
        Query query(connection_, kAllSurfaces);
        while (query.step()) {
            orRaise(context_.checkpoint());
            row([&] { (void)readSurface(query); });
        }
    }

    SqliteConnection& connection_;
    const ValueRules& values_;
    const RunContext& context_;
    std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> checkDatabase(SqliteConnection& connection, const ValueRules& values,
                                       const RunContext& context) {
    return Checker(connection, values, context).run();
}

}  // namespace shapedb::store
