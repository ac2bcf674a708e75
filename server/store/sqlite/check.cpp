#include "server/store/sqlite/check.h"

#include <algorithm>

#include "common/safe_text.h"
#include "server/store/key_rules.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sequences.h"

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
    "SELECT s.key, s.point_count, s.checksum, p.points, p.point_bytes, p.stored_bytes FROM shape s "
    "LEFT JOIN shape_points p ON p.shape_id = s.id ORDER BY s.id";
constexpr char kAllSignatures[] =
    "SELECT g.shape_id, g.points_version, g.generation, g.digest, g.bytes, g.views FROM signature g "
    "JOIN shape s ON s.id = g.shape_id";
constexpr char kAllSurfaces[] =
    "SELECT s.key, f.points_version, f.digest, f.bytes FROM shape_surface f JOIN shape s ON s.id = "
    "f.shape_id";
constexpr char kAllKeys[] = "SELECT key FROM shape";
constexpr char kShapesTotal[] = "SELECT count(*) FROM shape";

/// A rule between tables; the statement lists the keys of shapes that break it.
struct Rule {
    const char* sql;
    const char* problem;
};
constexpr char kSequenceProblems[] =
    "SELECT name, seq FROM sqlite_sequence WHERE typeof(seq) <> 'integer' OR seq < 0 OR seq > ?1";
constexpr char kCounterProblems[] =
    "SELECT 'collection ' || name FROM collection WHERE max(id, generation) > ?1 UNION ALL "
    "SELECT 'shape ' || key FROM shape WHERE max(id, version) > ?1 UNION ALL "
    "SELECT 'job ' || id FROM job WHERE max(id, attempts, stops) > ?1 UNION ALL "
    "SELECT 'rebuild ' || id FROM rebuild WHERE max(id, target_generation) > ?1 UNION ALL "
    "SELECT 'table tally' FROM tally WHERE commits < 0 OR commits > ?1";
constexpr char kAliasProblems[] =
    "SELECT a.name FROM collection_alias a JOIN collection c ON c.name = a.name";
constexpr Rule kRules[] = {
    {"SELECT s.key FROM shape s JOIN job j ON j.shape_id = s.id JOIN shape_points p ON p.shape_id = s.id "
     "WHERE "
     "j.point_bytes <> p.point_bytes",
     "has a job that counts other bytes than its points have"},
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id WHERE s.state = 1 AND NOT EXISTS "
     "(SELECT 1 FROM signature g WHERE g.shape_id = s.id AND g.generation = c.generation "
     "AND g.points_version = s.points_version)",
     "is ready but has no signature of its current points"},
    // An import queues its jobs when it is complete.
    {"SELECT s.key FROM shape s JOIN collection c ON c.id = s.collection_id WHERE s.state = 0 AND c.name "
     "<> " SHAPEDB_IMPORTING " AND NOT EXISTS (SELECT 1 FROM job j WHERE j.shape_id = s.id)",
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
    {"SELECT s.key FROM shape s WHERE max(abs(s.origin_x), abs(s.origin_y), abs(s.origin_z)) > 3.4e38",
     "has points relative to an origin that is out of range"},
};

class Checker {
  public:
    Checker(Connection& connection, const RunContext& context) : connection_(connection), context_(context) {}

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
                while (query.step()) add("shape " + quoted(query.text(0)) + " " + rule.problem);
            });
        }
        section([&] {
            Query query(connection_, kAliasProblems);
            while (query.step()) add(quoted(query.text(0)) + " is both a collection and an alias");
        });
        section([&] { counters(); });
        section([&] { keys(); });
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

    /// What counts up must never come to its end.
    void counters() {
        Query sequences(connection_, kSequenceProblems, kMostCounted);
        while (sequences.step()) {
            add("the id sequence of table " + sequences.text(0) + " stands at " + sequences.text(1) +
                ": no rows could be added any more");
        }
        Query counted(connection_, kCounterProblems, kMostCounted);
        while (counted.step()) add(counted.text(0) + " has an id, a version or a count beyond 2^62");
    }

    void keys() {
        Query all(connection_, kAllKeys);
        while (all.step()) {
            orRaise(context_.checkpoint());
            if (const auto problem = problemOfKey(all.text(0))) {
                add("shape " + quoted(escapeUnsafe(all.text(0))) + " has a key that is none: " + *problem);
            }
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
            });
        }
        context_.report("points", total, total);
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

    Connection& connection_;
    const RunContext& context_;
    std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> checkDatabase(Connection& connection, const RunContext& context) {
    return Checker(connection, context).run();
}

}  // namespace shapedb::store
