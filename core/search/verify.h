// SPDX-License-Identifier: GPL-3.0-or-later
// Verified search: the best candidates of a search are laid on the query (core/fit/), and how well they fit
// is part of their score.
//
// A signature says what a shape is like; only laying it on the query shows whether it is the same one, left
// or right, and where it lies. docs/verify.md has the formulas and what they gain.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/fit.h"
#include "core/fit/verdict.h"
#include "core/geometry/point.h"
#include "core/search/candidates.h"
#include "core/search/top_k.h"

namespace shapedb {

/// How candidates are verified.
struct VerifyOptions {
    /// The most candidates that are laid on the query: those that the signatures rank first; of a query of
    /// one side mostly those that views rank first (docs/views.md). With fewer shapes in the collection, or
    /// when no other can reach the hits, the answer is exact. 0: 32 for a reliable query, 64 for others, 128
    /// for pieces (ScoreOptions::partial), of which signatures know least.
    std::size_t mostCandidates = 0;
    /// Whether a camera saw the query from one place; nothing: judged from the points.
    std::optional<bool> oneSided{};
    /// Where that camera stood, in coordinates of the query: tells front from back. A query that has it
    /// shows one side, whatever `oneSided` says.
    std::optional<Point3> viewpoint{};
};

struct VerifiedHit {
    std::int64_t id = 0;
    /// In [0, 1]: from the distance of the signatures and the misfit. A candidate that was not verified
    /// counts as if it fitted like an unrelated shape, so that all scores of an answer can be compared.
    double score = 0.0;
    double signatureScore = 0.0;           ///< as topK gives it
    std::shared_ptr<const FitResult> fit;  ///< null if it was not verified
    Verdict verdict = Verdict::kNone;
    OwnGroup group{};                 ///< as Candidate
    std::optional<double> quality{};  ///< as Candidate
};

struct VerifiedResult {
    std::vector<VerifiedHit> hits;  ///< in the order of SearchResult::hits
    std::size_t verified = 0;       ///< candidates that were laid on the query
    double misfitShare = 0.0;       ///< weight of the misfit in the scores; 0 of an unverified search
    /// Whether verifying more candidates could change no hit.
    bool exact = false;
    double covered = 1.0;  ///< share of the collection that was searched (server/cluster)
    SearchCounts counts;   ///< of the search for candidates
    double seconds = 0.0;  ///< taken, by both
    std::shared_ptr<const Scorer> scorer;
};

/// A search, and what verifying it needs.
struct VerifiableQuery : BatchQuery {
    std::shared_ptr<const SurfacePoints> surface = nullptr;  ///< null: it cannot be verified
};

/// What is known of a query before it is laid on anything.
struct QueryTraits {
    /// The quality of its interior is that of a whole scan. One without attributes counts as reliable.
    bool reliable = true;
    /// It is not reliable, and most of its surface can be seen from one place.
    bool ofOneSide = false;
    /// The caller says that it is a piece.
    bool piece = false;
};

/// Judged from the points, or as `oneSided` says. A piece (`score.partial`) is of one side only if
/// `oneSided` says so: half of a shape is easily seen from one place. Errors: kOutOfMemory.
[[nodiscard]] Result<QueryTraits> traitsOf(const Signature& query, const SurfacePoints& surface,
                                           const ScoreOptions& score = {},
                                           std::optional<bool> oneSided = std::nullopt);

/// What the query may be a scan of: whole or a piece. Of one side too if it is not reliable; a piece only if
/// it is known to be of one side.
[[nodiscard]] FitKinds kindsOfQuery(const QueryTraits& traits) noexcept;

/// The score of a candidate whose signature scores `signatureScore` and whose misfit is `misfit`
/// (FitResult::misfit). Falls with the misfit, rises with the signature's score, and is 1 for the same
/// signature whatever the misfit.
///
/// It is scoreOfDistance of the mean of distanceOfScore(signatureScore) and `misfit`, the latter weighted by
/// `share`, in [0, 1].
[[nodiscard]] double verifiedScore(double signatureScore, double misfit, double share);

/// The weight of the misfit, in (0, 1).
[[nodiscard]] double misfitShare(const QueryTraits& traits, const ScoreOptions& score) noexcept;

/// Whether an answer tells left from right no better than a guess, although mirror images were to count as
/// different: nothing was laid on the query, and all statistics of a signature but the parts are those of its
/// mirror image too.
[[nodiscard]] bool leftRightUntold(const Signature& query, const ScoreOptions& score, bool verified) noexcept;

/// How many candidates are verified unless the caller says so.
[[nodiscard]] std::size_t candidatesFor(const QueryTraits& traits) noexcept;

/// Two shapes compared, and one laid on the other.
struct VerifiedExplanation {
    double score = 0.0;            ///< as VerifiedHit::score
    double signatureScore = 0.0;   ///< of the signatures
    Explanation explanation;       ///< with the motion and the term of the fit, if there is one
    std::optional<FitResult> fit;  ///< if both have surface points
    Verdict verdict = Verdict::kNone;
};

/// Adds the fit to the terms of a verified hit, whose misfit has the weight `share` in the score.
void addFit(const FitResult& fit, double share, Explanation& explanation);

/// As for a hit of a search. Surface points may be null; without them, and for signatures of profile `paper`,
/// which a search does not verify by default, the score is that of the signatures. Reports progress as stage
/// "fit". Errors: those of fit.
[[nodiscard]] Result<VerifiedExplanation> explainVerified(
    const Signature& query, const SurfacePoints* querySurface, const Signature& other,
    const SurfacePoints* otherSurface, const ScoreOptions& options, const RunContext& context = {});

/// The `options.k` best scores of a snapshot, verified. With groups half of the candidates are the best of
/// each group by signature, so that many shapes of one group do not keep the others from being verified. Uses
/// the threads of the caller's oneTBB arena; their number does not change a bit. Reports progress as stages
/// "search", "views" and "verify".
///
/// Errors: those of topK and of `surfaceOf`; kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<VerifiedResult> topKVerified(const Signature& query, const SurfacePoints& surface,
                                                  const SignatureSet& set, const SearchOptions& options,
                                                  const VerifyOptions& verify, const SurfaceOf& surfaceOf,
                                                  const RunContext& context = {});
/// The same among the shapes of `source`, which must be of this query and surface.
[[nodiscard]] Result<VerifiedResult> topKVerified(const Signature& query, const SurfacePoints& surface,
                                                  const CandidateSource& source, const SearchOptions& options,
                                                  const VerifyOptions& verify,
                                                  const RunContext& context = {});

/// As topK, among the shapes of `source`: hits that were not verified, with the scores of their signatures.
[[nodiscard]] Result<VerifiedResult> topKUnverified(const CandidateSource& source,
                                                    const SearchOptions& options,
                                                    const RunContext& context = {});

}  // namespace shapedb
