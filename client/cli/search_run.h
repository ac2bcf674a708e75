// SPDX-License-Identifier: GPL-3.0-or-later
// A search with a scan file or a stored shape, as `query` and `report` make it, and its answer as text, as
// JSON and as rows of a table.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/client.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "core/base/error.h"

namespace shapedb::cli {

/// What may be asked of a search, and how its scan is read.
struct SearchFlags {
    client::SearchOptions options;
    ScoreFlags score;
    VerifyFlags verify;
    ClusterFlags cluster;
    ScanFlags scan;
    std::optional<LengthUnit> unit;
    bool includeSelf = false;  ///< of a search by key

    /// `options` with what the other flags say.
    [[nodiscard]] client::SearchOptions resolve() const;
};

/// `flags` must outlive the parsing.
void addSearchFlags(CLI::App& command, SearchFlags& flags);

/// An answer in the unit and coordinates of the query.
struct Answer {
    std::string query;  ///< path or key
    bool stored = false;
    client::SearchReply reply;
    PointCloud points;  ///< of the query's file, where they were; empty of a stored shape
    std::optional<Scene> scene;
    std::size_t pointsInScene = 0;
    std::string unit;  ///< of all lengths; empty if neither is known
};

/// Searches of one command. `factor`: factorToCollection of --unit.
struct Searcher {
    const client::Client& client;
    const SearchFlags& flags;
    double factor = 1.0;

    /// Errors name the file.
    [[nodiscard]] Result<Answer> withFile(const std::string& path, const RunContext& context) const;
    [[nodiscard]] Result<Answer> withKey(const std::string& key, const RunContext& context) const;

    /// The query of an answer as it was scanned. Errors: those of getPoints.
    [[nodiscard]] Result<PointCloud> pointsOf(const Answer& answer, const RunContext& context) const;
    /// A hit moved onto the query, in its coordinates. Errors: those of getPoints; kNotReady (no motion is
    /// known: neither verified nor explained).
    [[nodiscard]] Result<PointCloud> pointsOf(const client::Hit& hit, const RunContext& context) const;

  private:
    void finish(Answer& answer) const;
};

/// From coordinates of the hit to those of the query: that of its fit, or else of its explanation.
[[nodiscard]] std::optional<Motion> motionOf(const client::Hit& hit);

/// Which hits the text explains.
enum class Explained { kNone, kFirst, kAll };

[[nodiscard]] nlohmann::json answerJson(const SearchFlags& flags, const Answer& answer);
[[nodiscard]] std::string answerText(const SearchFlags& flags, const Answer& answer, Explained explained);

/// The first line of a CSV file of hits.
[[nodiscard]] std::string hitsCsvHeader();
/// A line for each hit.
[[nodiscard]] std::string hitsCsv(const Answer& answer);

}  // namespace shapedb::cli
