// SPDX-License-Identifier: GPL-3.0-or-later
// Where a search finds the shapes that it ranks: one set of signatures in this process, or the parts of a
// collection that several servers hold. What is made of them (verify.h) is the same code, and so the same
// bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/fit.h"
#include "core/search/top_k.h"
#include "core/views/view_distance.h"

namespace shapedb {

/// A value of the metadata that a search groups by; null: none. Owned, so that it outlives the set.
using OwnGroup = std::shared_ptr<const std::string>;

/// A shape that may become a hit, with what an answer tells of it.
struct Candidate {
    std::int64_t id = 0;
    double score = 0.0;  ///< of the signatures
    OwnGroup group{};    ///< of searches with groups
    /// Of its interior, 0 to 1; nothing: its signature has no attributes.
    std::optional<double> quality{};
};

/// One that views rank.
struct ViewCandidate {
    Candidate shape;
    std::uint32_t distance = 0;  ///< ViewQuery::distance of its nearest view
    bool comparable = true;      ///< the signatures can be compared too: `shape.score` counts
};

/// The shapes whose views are nearest to a scan of one side.
struct ViewSearch {
    ViewSignature view;
    ViewOptions options;
    std::size_t count = 0;
};

/// What is looked for at once.
struct CandidateSearch {
    SearchOptions options;
    bool best = true;                   ///< the `options.k` best, whatever their groups
    bool groups = false;                ///< the best of each of the `options.k` best groups
    std::optional<ViewSearch> views{};  ///< besides
};

struct Candidates {
    std::vector<Candidate> best;         ///< as topK
    std::vector<Candidate> ofGroups;     ///< as bestOfGroups
    std::vector<ViewCandidate> byViews;  ///< as nearestByViews
    SearchCounts counts;                 ///< of the first of the searches
};

/// A shape, and how it was laid on the query.
struct FittedShape {
    std::int64_t id = 0;
    std::shared_ptr<const FitResult> fit;
};

/// Of one query. Thread-safe. Errors: those of topK and of fit; of another server kUnavailable too.
class CandidateSource {
  public:
    virtual ~CandidateSource() = default;

    /// What scores the candidates, to explain them.
    [[nodiscard]] virtual const std::shared_ptr<const Scorer>& scorer() const = 0;
    /// Reports progress as stages "search" and "views".
    [[nodiscard]] virtual Result<Candidates> find(const CandidateSearch& search,
                                                  const RunContext& context) const = 0;
    /// As hitsOfGroups, of groups that `find` told.
    [[nodiscard]] virtual Result<std::vector<Candidate>> findOfGroups(const SearchOptions& options,
                                                                      const std::vector<OwnGroup>& groups,
                                                                      const RunContext& context) const = 0;
    /// Lays these shapes on the query: for each its fit, or null if it has no surface points. The first error
    /// in their order is that of all.
    [[nodiscard]] virtual Result<std::vector<std::shared_ptr<const FitResult>>> fitAll(
        const std::vector<std::int64_t>& ids, const FitOptions& options, const RunContext& context) const = 0;
    /// As preferUnmirrored, in the same way.
    [[nodiscard]] virtual Result<std::vector<std::shared_ptr<const FitResult>>> preferUnmirroredAll(
        const std::vector<FittedShape>& shapes, const FitOptions& options,
        const RunContext& context) const = 0;
};

/// The surface points of a shape; null for one that has none (yet). Called from several threads at once.
/// Errors end the search.
using SurfaceOf = std::function<Result<std::shared_ptr<const SurfacePoints>>(std::int64_t id)>;

/// Those of a set. Uses the threads of the caller's oneTBB arena; their number does not change a bit.
class SetCandidates final : public CandidateSource {
  public:
    /// `querySurface`: null if nothing is to be laid on the query. `set` and `surfaceOf` must outlive it.
    /// Errors: kInvalidArgument (kernel width; a query with points and weights alone where signatures have
    /// attributes), kOutOfMemory.
    [[nodiscard]] static Result<SetCandidates> make(const Signature& query, const SurfacePoints* querySurface,
                                                    const ScoreOptions& score, const SignatureSet& set,
                                                    const SurfaceOf& surfaceOf);

    [[nodiscard]] const std::shared_ptr<const Scorer>& scorer() const override { return scorer_; }
    [[nodiscard]] Result<Candidates> find(const CandidateSearch& search,
                                          const RunContext& context) const override;
    [[nodiscard]] Result<std::vector<Candidate>> findOfGroups(const SearchOptions& options,
                                                              const std::vector<OwnGroup>& groups,
                                                              const RunContext& context) const override;
    [[nodiscard]] Result<std::vector<std::shared_ptr<const FitResult>>> fitAll(
        const std::vector<std::int64_t>& ids, const FitOptions& options,
        const RunContext& context) const override;
    [[nodiscard]] Result<std::vector<std::shared_ptr<const FitResult>>> preferUnmirroredAll(
        const std::vector<FittedShape>& shapes, const FitOptions& options,
        const RunContext& context) const override;

  private:
    SetCandidates(std::shared_ptr<const Scorer> scorer, const SignatureSet& set, const SurfaceOf& surfaceOf)
        : scorer_(std::move(scorer)), set_(set), surfaceOf_(surfaceOf) {}
    template <typename Body>
    Result<std::vector<std::shared_ptr<const FitResult>>> forEach(std::size_t count,
                                                                  const RunContext& context,
                                                                  const Body& body) const;
    Candidate candidate(const SearchHit& hit, const std::optional<Grouping>& grouping) const;
    std::vector<Candidate> candidates(const std::vector<SearchHit>& hits,
                                      const std::optional<Grouping>& grouping) const;

    std::shared_ptr<const Scorer> scorer_;
    std::optional<FitQuery> laidOn_;
    const SignatureSet& set_;
    const SurfaceOf& surfaceOf_;
};

/// Of its interior, in [0, 1]; nothing for a row without attributes.
[[nodiscard]] std::optional<double> qualityOf(const SignatureBlock& block, std::size_t row);

// What several sources found, each of a part of the same collection, put together as if one had searched all
// of it.

[[nodiscard]] Candidates merged(std::vector<Candidates> parts, const CandidateSearch& search);
/// Of CandidateSource::findOfGroups.
[[nodiscard]] std::vector<Candidate> mergedOfGroups(std::vector<std::vector<Candidate>> parts,
                                                    std::size_t groups, std::size_t perGroup);

}  // namespace shapedb
