// SPDX-License-Identifier: GPL-3.0-or-later
// Makes one server what another is, pass after pass, while that is in use.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/copy_difference.h"

namespace shapedb::cli {

/// What could not be done there; it is not tried again until it changes here.
struct CopyRefusal {
    std::string what;  ///< "COLLECTION/KEY", or a collection or alias
    Error error;
};

/// What a pass did.
struct CopyCounts {
    std::uint64_t added = 0;
    std::uint64_t replaced = 0;  ///< the points
    std::uint64_t metadataChanged = 0;
    std::uint64_t deleted = 0;
    std::uint64_t collections = 0;  ///< steps taken with collections and aliases

    [[nodiscard]] std::uint64_t all() const {
        return added + replaced + metadataChanged + deleted + collections;
    }
    CopyCounts& operator+=(const CopyCounts& more);
};

struct CopyPass {
    CopyCounts counts;
    std::vector<CopyRefusal> refused;  ///< for the first time
    bool whole = false;                ///< every key was compared
    /// No difference was found but what has been refused: the two were alike when the pass began.
    bool clean = false;
};

/// Follows one server. What both have is compared by key, points (SHA-256 and origin) and metadata, never by
/// id, version or time.
class CopyRun {
  public:
    /// `progress`: what is done, how much of it, and of how much. All must outlive the run.
    using Progress = std::function<void(const std::string& what, std::uint64_t done, std::uint64_t total)>;
    CopyRun(const CopySides& sides, unsigned jobs, const RunContext& context, Progress progress);

    /// Finds what differs and takes it over. A whole pass compares every key, which the first one of a run
    /// must do. Others look at the shapes that changed since the pass before by the clock of the server, and
    /// at every key of a collection only if the two have not as many shapes: that is how deletions are found.
    /// Errors: of either server, if the next pass would meet it too.
    [[nodiscard]] Result<CopyPass> pass(bool whole);

    /// What has been refused and still differs.
    [[nodiscard]] std::uint64_t refusals() const { return refused_.size(); }

  private:
    /// Collection and key; without a key a step with collections.
    using Place = std::pair<std::string, std::string>;
    struct Refused {
        std::int64_t version = 0;
        bool missing = false;  ///< there is no such shape there
    };

    Result<void> alignCollections(const std::vector<client::Collection>& from,
                                  const std::vector<client::Collection>& to, CopyPass& pass);
    Result<void> take(const CollectionStep& step);
    Result<void> alignShapes(const std::string& collection, bool whole, CopyPass& pass);
    Result<void> compareAll(const std::string& collection, CopyPass& pass);
    Result<void> compareRecent(const std::string& collection, CopyPass& pass);
    Result<void> compareCounts(const std::vector<client::Collection>& before, CopyPass& pass);
    /// Those of the pairs that differ. Empties `pairs`.
    Result<void> apply(const std::string& collection, std::vector<ShapePair>& pairs, CopyPass& pass);
    /// False: it is no longer so.
    Result<bool> apply(const std::string& collection, const ShapePair& pair, ShapeDifference difference);
    void note(const std::string& collection, const ShapePair& pair, ShapeDifference difference,
              const Result<bool>& done, CopyPass& pass);
    [[nodiscard]] bool wasRefused(const std::string& collection, const ShapePair& pair);
    [[nodiscard]] bool wasRefused(const CollectionStep& step) const;
    /// Whether the collection is here alone, because it was refused there.
    [[nodiscard]] bool lacks(const client::Collection& collection) const;

    CopySides sides_;
    unsigned jobs_;
    RunContext context_;
    Progress progress_;
    std::map<std::string, client::Timestamp>
        newest_;  ///< of what was seen of a collection, by Shape::updated
    std::map<std::string, client::Timestamp> madeOf_;  ///< as of stepsBetween
    std::set<std::string> uneven_;                     ///< collections whose every key is to be compared
    std::map<std::string, std::int64_t> rebuilding_;   ///< of collections there, the generation here
    std::map<Place, Refused> refused_;
    std::mutex mutex_;  ///< guards a pass and `refused_` while shapes are copied
};

}  // namespace shapedb::cli
