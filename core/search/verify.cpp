#include "core/search/verify.h"

#include <algorithm>
#include <new>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/matching/kernel.h"
#include "core/matching/score_scale.h"

namespace shapedb {

namespace {

// Share of the misfit in the distance. Half: the signature tells kinds apart better, the fit single objects.
// Three quarters where the signature knows least: of a scan with an unreliable interior, of a piece, and of
// left and right.
constexpr double kMisfitShare = 0.5;
constexpr double kMisfitShareUnsure = 0.75;

// A query whose interior is less reliable may be a scan from one side. Whole scans with 0.5 % noise have 0.69
// to 0.95 (nine tenths of them), scans from one side 0.15 to 0.68.
constexpr double kReliableQuality = 0.69;

// What an unverified candidate counts as: typical of unrelated shapes.
constexpr double kUnverifiedMisfit = 1.0;

// Candidates between two looks at whether the rest can still reach the hits. Not the number of threads, on
// which nothing may depend.
constexpr std::size_t kChunk = 16;

bool verifiedRanksBefore(const VerifiedHit& a, const VerifiedHit& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
}

class Verifier {
  public:
    Verifier(const FitQuery& query, const FitKinds& kinds, const SearchOptions& options,
             const SurfaceOf& surfaceOf, const RunContext& context)
        : query_(query), kinds_(kinds), options_(options), surfaceOf_(surfaceOf), context_(context) {
        fit_.kinds = kinds;
        fit_.keepScale = options.score.keepScale;
        fit_.reflection = options.score.reflection;
    }

    // Of `candidates`, ranked by their signatures, verifies at most `most`; `all`: there are no others.
    Result<VerifiedResult> run(const std::vector<SearchHit>& candidates, std::size_t most, bool all) {
        for (const SearchHit& candidate : candidates) {
            hits_.push_back(
                {candidate.id, scoreOf(candidate.score, kUnverifiedMisfit), candidate.score, nullptr});
        }
        const std::size_t limit = std::min(most, hits_.size());
        std::size_t done = 0;
        bool exact = false;
        while (done < limit && !exact) {
            context_.report("verify", done, limit);
            const std::size_t end = std::min(limit, done + kChunk);
            RETURN_IF_ERROR(verify(done, end));
            done = end;
            exact = done < hits_.size() && !reachable(hits_[done].signatureScore, done);
        }
        context_.report("verify", limit, limit);
        VerifiedResult result;
        result.misfitShare = misfitShare(kinds_, options_.score);
        result.verified = static_cast<std::size_t>(std::count_if(
            hits_.begin(), hits_.end(), [](const VerifiedHit& hit) { return hit.fit != nullptr; }));
        result.exact = exact || (all && done == hits_.size());
        std::sort(hits_.begin(), hits_.end(), verifiedRanksBefore);
        const auto end = std::find_if(hits_.begin(), hits_.end(),
                                      [&](const VerifiedHit& hit) { return hit.score < options_.threshold; });
        hits_.erase(end, hits_.end());
        if (hits_.size() > options_.k) hits_.resize(options_.k);
        result.hits = std::move(hits_);
        return result;
    }

  private:
    double scoreOf(double signatureScore, double misfit) const {
        return verifiedScore(signatureScore, misfit, kinds_, options_.score);
    }

    // Whether a candidate that the signatures score so may become one of the hits, given the first `done`.
    bool reachable(double signatureScore, std::size_t done) const {
        const double best = scoreOf(signatureScore, 0.0);
        if (best < options_.threshold) return false;
        const auto better = std::count_if(hits_.begin(), hits_.begin() + static_cast<std::ptrdiff_t>(done),
                                          [&](const VerifiedHit& hit) { return hit.score > best; });
        return static_cast<std::size_t>(better) < options_.k;
    }

    Result<void> verify(std::size_t begin, std::size_t end) {
        std::vector<Result<void>> outcomes(end - begin);
        RETURN_IF_ERROR(parallelFor(end - begin, 1, context_, [&](std::size_t i, std::size_t) {
            outcomes[i] = verifyOne(hits_[begin + i]);
        }));
        for (Result<void>& outcome : outcomes) RETURN_IF_ERROR(outcome);
        return {};
    }

    Result<void> verifyOne(VerifiedHit& hit) const {
        const auto surface = surfaceOf_(hit.id);
        RETURN_IF_ERROR(surface);
        if (*surface == nullptr) return {};
        // Its own progress would run backwards beside that of the others.
        RunContext quiet = context_;
        quiet.progress = nullptr;
        auto fitted = fit(query_, **surface, fit_, quiet);
        RETURN_IF_ERROR(fitted);
        hit.score = scoreOf(hit.signatureScore, fitted->misfit);
        hit.fit = std::make_shared<const FitResult>(std::move(*fitted));
        return {};
    }

    const FitQuery& query_;
    const FitKinds kinds_;
    const SearchOptions& options_;
    const SurfaceOf& surfaceOf_;
    const RunContext& context_;
    FitOptions fit_;
    std::vector<VerifiedHit> hits_;
};

}  // namespace

FitKinds kindsOfQuery(const Signature& query, const ScoreOptions& score) {
    const bool reliable = !query.attributes || query.attributes->quality >= 255.0 * kReliableQuality;
    return {true, !reliable, score.partial};
}

double misfitShare(const FitKinds& kinds, const ScoreOptions& score) noexcept {
    return kinds.oneSided || kinds.piece || !score.reflection ? kMisfitShareUnsure : kMisfitShare;
}

VerifiedResult unverified(SearchResult found) {
    VerifiedResult result;
    for (const SearchHit& hit : found.hits) result.hits.push_back({hit.id, hit.score, hit.score, nullptr});
    result.exact = true;
    result.counts = found.counts;
    result.seconds = found.seconds;
    result.scorer = std::move(found.scorer);
    return result;
}

double verifiedScore(double signatureScore, double misfit, const FitKinds& kinds, const ScoreOptions& score) {
    if (signatureScore >= 1.0) return 1.0;
    const double share = misfitShare(kinds, score);
    const double distance = distanceOfScore(signatureScore);
    return belowOne(scoreOfDistance((1.0 - share) * distance + share * misfit));
}

Result<VerifiedResult> topKVerified(const Signature& query, const FitQuery& querySurface,
                                    const SignatureSet& set, const SearchOptions& options,
                                    const VerifyOptions& verify, const SurfaceOf& surfaceOf,
                                    const RunContext& context) {
    RETURN_IF_ERROR(validate(options));
    if (verify.mostCandidates == 0) {
        return fail(ErrorCode::kInvalidArgument, "at least 1 candidate must be verified");
    }
    const auto began = RunContext::Clock::now();
    SearchOptions wide = options;
    // One more than are verified, to see whether it could reach the hits.
    wide.k = std::max(options.k, verify.mostCandidates + 1);
    // Candidates below the threshold may reach it by fitting well.
    wide.threshold = 0.0;
    auto found = topK(query, set, wide, context);
    RETURN_IF_ERROR(found);
    try {
        const FitKinds kinds = kindsOfQuery(query, options.score);
        auto result = Verifier(querySurface, kinds, options, surfaceOf, context)
                          .run(found->hits, verify.mostCandidates, found->hits.size() < wide.k);
        RETURN_IF_ERROR(result);
        result->counts = found->counts;
        result->scorer = std::move(found->scorer);
        result->seconds = std::chrono::duration<double>(RunContext::Clock::now() - began).count();
        return result;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to verify the hits of a search");
    }
}

}  // namespace shapedb
