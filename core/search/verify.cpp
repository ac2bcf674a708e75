// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/verify.h"

#include <algorithm>
#include <new>
#include <unordered_set>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/matching/kernel.h"
#include "core/matching/score.h"
#include "core/views/views.h"

namespace shapedb {

namespace {

// Share of the misfit in the distance. Half: the signature tells kinds apart better, the fit single objects.
// Three quarters where the signature knows least: of a scan with an unreliable interior, of a piece, and of
// left and right.
constexpr double kMisfitShare = 0.5;
constexpr double kMisfitShareUnsure = 0.75;
constexpr double kMisfitShareOfPiece = 0.85;

// Candidates of a query unless the caller says how many: an unreliable signature ranks the right one lower.
constexpr std::size_t kCandidates = 32;
constexpr std::size_t kCandidatesUnsure = 64;
constexpr std::size_t kCandidatesOfPiece = 128;

// A query whose interior is less reliable may be a scan from one side. Whole scans with 0.5 % noise have 0.69
// to 0.95 (nine tenths of them), scans from one side 0.15 to 0.68.
constexpr double kReliableQuality = 0.69;

// Of a query of one side at least this share of the surface is seen from one place.
constexpr double kSeenShare = 0.80;

// Of the candidates of a query of one side this share is taken by views, the others by signatures.
constexpr double kShareOfViews = 0.75;

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
    Verifier(const CandidateSource& source, const QueryTraits& traits, const SearchOptions& options,
             const RunContext& context)
        : source_(source), share_(misfitShare(traits, options.score)), options_(options), context_(context) {
        fit_.kinds = kindsOfQuery(traits);
        fit_.keepScale = options.score.keepScale;
        fit_.reflection = options.score.reflection;
    }

    // Verifies `candidates` in their order, at most `most`; `all`: there are no others. A candidate that is
    // not among them has no better signature score than the last of them.
    Result<VerifiedResult> run(const std::vector<Candidate>& candidates, std::size_t most, bool all) {
        for (const Candidate& candidate : candidates) {
            hits_.push_back({candidate.id, scoreOf(candidate.score, kUnverifiedMisfit), candidate.score,
                             nullptr, Verdict::kNone, candidate.group, candidate.quality});
        }
        const std::size_t limit = std::min(most, hits_.size());
        std::size_t done = 0;
        bool exact = false;
        while (done < limit && !exact) {
            context_.report("verify", done, limit);
            const std::size_t end = std::min(limit, done + kChunk);
            RETURN_IF_ERROR(verify(done, end));
            done = end;
            exact = done < hits_.size() && !reachable(bestAfter(done), done);
        }
        context_.report("verify", limit, limit);
        VerifiedResult result;
        result.misfitShare = share_;
        result.verified = static_cast<std::size_t>(std::count_if(
            hits_.begin(), hits_.end(), [](const VerifiedHit& hit) { return hit.fit != nullptr; }));
        result.exact = exact || (all && done == hits_.size());
        std::sort(hits_.begin(), hits_.end(), verifiedRanksBefore);
        const auto end = std::find_if(hits_.begin(), hits_.end(),
                                      [&](const VerifiedHit& hit) { return hit.score < options_.threshold; });
        hits_.erase(end, hits_.end());
        if (options_.grouping) {
            const auto group = [](const VerifiedHit& hit) { return hit.group.get(); };
            keepBestOfGroups(hits_, options_.k, options_.grouping->perGroup, group);
            bringGroupsTogether(hits_, group);
        } else if (hits_.size() > options_.k) {
            hits_.resize(options_.k);
        }
        RETURN_IF_ERROR(settleHands());
        result.hits = std::move(hits_);
        return result;
    }

  private:
    double scoreOf(double signatureScore, double misfit) const {
        return verifiedScore(signatureScore, misfit, share_);
    }

    double bestAfter(std::size_t done) const {
        double best = 0.0;
        for (std::size_t i = done; i < hits_.size(); ++i) best = std::max(best, hits_[i].signatureScore);
        return best;
    }

    // Whether a candidate that the signatures score so may become one of the hits, given the first `done`.
    bool reachable(double signatureScore, std::size_t done) const {
        const double best = scoreOf(signatureScore, 0.0);
        if (best < options_.threshold) return false;
        const auto end = hits_.begin() + static_cast<std::ptrdiff_t>(done);
        const auto isBetter = [&](const VerifiedHit& hit) { return hit.score > best; };
        if (!options_.grouping) {
            return static_cast<std::size_t>(std::count_if(hits_.begin(), end, isBetter)) < options_.k;
        }
        // Not once k groups have all the hits they may have.
        GroupMap<std::size_t> better;
        std::size_t full = 0;
        for (auto hit = hits_.begin(); hit != end; ++hit) {
            if (isBetter(*hit) && ++better[hit->group.get()] == options_.grouping->perGroup) ++full;
        }
        return full < options_.k;
    }

    Result<void> verify(std::size_t begin, std::size_t end) {
        std::vector<std::int64_t> ids;
        for (std::size_t i = begin; i < end; ++i) ids.push_back(hits_[i].id);
        auto fits = source_.fitAll(ids, fit_, context_);
        RETURN_IF_ERROR(fits);
        for (std::size_t i = begin; i < end; ++i) {
            VerifiedHit& hit = hits_[i];
            hit.fit = std::move((*fits)[i - begin]);
            if (!hit.fit) continue;
            hit.score = scoreOf(hit.signatureScore, hit.fit->misfit);
            hit.verdict = verdictOf(distanceOfScore(hit.signatureScore), *hit.fit, fit_.reflection);
        }
        return {};
    }

    // No hit is shown mirrored that need not be. Their scores stay.
    Result<void> settleHands() {
        std::vector<VerifiedHit*> mirrored;
        std::vector<FittedShape> shapes;
        for (VerifiedHit& hit : hits_) {
            if (!hit.fit || !hit.fit->best.motion.reflected) continue;
            mirrored.push_back(&hit);
            shapes.push_back({hit.id, hit.fit});
        }
        if (shapes.empty()) return {};
        auto settled = source_.preferUnmirroredAll(shapes, fit_, context_);
        RETURN_IF_ERROR(settled);
        for (std::size_t i = 0; i < mirrored.size(); ++i) mirrored[i]->fit = std::move((*settled)[i]);
        return {};
    }

    const CandidateSource& source_;
    const double share_;
    const SearchOptions& options_;
    const RunContext& context_;
    FitOptions fit_;
    std::vector<VerifiedHit> hits_;
};

}  // namespace

Result<QueryTraits> traitsOf(const Signature& query, const SurfacePoints& surface, const ScoreOptions& score,
                             std::optional<bool> oneSided) {
    if (oneSided.value_or(false)) return QueryTraits{false, true, score.partial};
    QueryTraits traits;
    traits.piece = score.partial;
    traits.reliable = !query.attributes || query.attributes->quality >= 255.0 * kReliableQuality;
    if (traits.reliable || traits.piece || oneSided) return traits;
    const auto seen = seenShare(surface);
    RETURN_IF_ERROR(seen);
    traits.ofOneSide = *seen >= kSeenShare;
    return traits;
}

FitKinds kindsOfQuery(const QueryTraits& traits) noexcept {
    return {true, traits.ofOneSide || !(traits.reliable || traits.piece), true};
}

double misfitShare(const QueryTraits& traits, const ScoreOptions& score) noexcept {
    if (traits.piece) return kMisfitShareOfPiece;
    return traits.reliable && score.reflection ? kMisfitShare : kMisfitShareUnsure;
}

bool leftRightUntold(const Signature& query, const ScoreOptions& score, bool verified) noexcept {
    return !score.reflection && !verified && query.attributes.has_value();
}

std::size_t candidatesFor(const QueryTraits& traits) noexcept {
    if (traits.piece) return kCandidatesOfPiece;
    return traits.reliable ? kCandidates : kCandidatesUnsure;
}

double verifiedScore(double signatureScore, double misfit, double share) {
    if (signatureScore >= 1.0) return 1.0;
    return belowOne(scoreOfDistance((1.0 - share) * distanceOfScore(signatureScore) + share * misfit));
}

void addFit(const FitResult& fit, double share, Explanation& explanation) {
    for (ScoreTerm& term : explanation.terms) term.weight *= 1.0 - share;
    if (!explanation.terms.empty()) explanation.terms.push_back({"fit", fit.misfit, share});
}

Result<VerifiedExplanation> explainVerified(const Signature& query, const SurfacePoints* querySurface,
                                            const Signature& other, const SurfacePoints* otherSurface,
                                            const ScoreOptions& options, const RunContext& context) {
    VerifiedExplanation result;
    result.explanation = explain(query, other, options);
    result.signatureScore = result.explanation.score;
    result.score = result.signatureScore;
    if (querySurface == nullptr || otherSurface == nullptr) return result;
    const auto traits = traitsOf(query, *querySurface, options);
    RETURN_IF_ERROR(traits);
    auto fitted = align(FitQuery(*querySurface), *otherSurface,
                        {kindsOfQuery(*traits), options.keepScale, options.reflection}, context);
    RETURN_IF_ERROR(fitted);
    setMotion(fitted->best.motion, query, other, result.explanation);
    result.verdict = verdictOf(distanceOfScore(result.signatureScore), *fitted, options.reflection);
    if (!result.explanation.terms.empty()) {
        const double share = misfitShare(*traits, options);
        result.score = verifiedScore(result.signatureScore, fitted->misfit, share);
        addFit(*fitted, share, result.explanation);
    }
    result.fit = std::move(*fitted);
    return result;
}

namespace {

// What of a search for candidates a query of one side needs besides.
Result<ViewSearch> viewSearch(const SurfacePoints& surface, const SearchOptions& options,
                              const VerifyOptions& verify, std::size_t most) {
    const Point3 towards = verify.viewpoint ? *verify.viewpoint - surface.centre : Point3{};
    const auto view = makeViewOfScan(surface, towards);
    RETURN_IF_ERROR(view);
    return ViewSearch{
        *view, {options.score.reflection, options.score.keepScale, verify.viewpoint.has_value()}, most};
}

// Those that views rank first before the others, after a few that signatures rank first.
std::vector<Candidate> withViewsFirst(const std::vector<Candidate>& best,
                                      const std::vector<ViewCandidate>& byViews, std::size_t most) {
    // Some are among those of the signatures: then further ones take their places.
    const auto ofViews = static_cast<std::size_t>(kShareOfViews * static_cast<double>(most));
    const auto ofSignatures = std::min(best.size(), most - ofViews);
    std::vector<Candidate> order(best.begin(), best.begin() + static_cast<std::ptrdiff_t>(ofSignatures));
    const auto isTaken = [&](std::int64_t id) {
        return std::any_of(order.begin(), order.end(), [&](const Candidate& one) { return one.id == id; });
    };
    for (const ViewCandidate& near : byViews) {
        if (order.size() >= most) break;
        if (near.comparable && !isTaken(near.shape.id)) order.push_back(near.shape);
    }
    for (auto one = best.begin() + static_cast<std::ptrdiff_t>(ofSignatures); one != best.end(); ++one) {
        if (!isTaken(one->id)) order.push_back(*one);
    }
    return order;
}

// Of candidates in groups half are the first of `order`, whatever their groups, and half the first of
// `ofGroups`: so the best shape of a group is found though another has the better signature, and many shapes
// of one group do not keep the others from being verified.
std::vector<Candidate> withGroups(const std::vector<Candidate>& order, std::vector<Candidate> ofGroups,
                                  std::size_t most) {
    const std::size_t all = order.size() + ofGroups.size();
    std::sort(ofGroups.begin(), ofGroups.end(), [](const Candidate& a, const Candidate& b) {
        return a.score != b.score ? a.score > b.score : a.id < b.id;
    });
    std::vector<Candidate> mixed;
    std::unordered_set<std::int64_t> taken;
    const auto take = [&](const std::vector<Candidate>& from, std::size_t size) {
        for (auto one = from.begin(); one != from.end() && mixed.size() < size; ++one) {
            if (taken.insert(one->id).second) mixed.push_back(*one);
        }
    };
    take(order, most / 2);
    take(ofGroups, most);
    take(order, all);
    take(ofGroups, all);
    return mixed;
}

// The best hits of each of the groups whose best hits `first` are, group after group.
Result<std::vector<Candidate>> allOfGroups(const CandidateSource& source, const SearchOptions& options,
                                           std::vector<Candidate> first, const RunContext& context) {
    if (options.grouping->perGroup == 1 || first.empty()) return first;
    std::vector<OwnGroup> groups;
    for (const Candidate& candidate : first) groups.push_back(candidate.group);
    auto all = source.findOfGroups(options, groups, context);
    RETURN_IF_ERROR(all);
    bringGroupsTogether(*all, [](const Candidate& candidate) { return candidate.group.get(); });
    return all;
}

// Runs a search, times it, and makes an error of a failed allocation.
template <typename Search>
Result<VerifiedResult> timed(const CandidateSource& source, const SearchOptions& options,
                             const Search& search) {
    RETURN_IF_ERROR(validate(options));
    const auto began = RunContext::Clock::now();
    try {
        Result<VerifiedResult> result = search();
        RETURN_IF_ERROR(result);
        result->scorer = source.scorer();
        result->seconds = std::chrono::duration<double>(RunContext::Clock::now() - began).count();
        return result;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to verify the hits of a search");
    }
}

Result<VerifiedResult> verified(const Signature& query, const SurfacePoints& surface,
                                const CandidateSource& source, const SearchOptions& options,
                                const VerifyOptions& verify, const RunContext& context) {
    const auto traits = traitsOf(query, surface, options.score, verify.viewpoint ? true : verify.oneSided);
    RETURN_IF_ERROR(traits);
    const std::size_t most = verify.mostCandidates > 0 ? verify.mostCandidates : candidatesFor(*traits);
    CandidateSearch wide{options};
    // One more than are verified, to see whether it could reach the hits.
    wide.options.k = std::max(options.k, most + 1);
    // Candidates below the threshold may reach it by fitting well.
    wide.options.threshold = 0.0;
    wide.groups = options.grouping.has_value();
    if (traits->ofOneSide) {
        auto views = viewSearch(surface, options, verify, most);
        RETURN_IF_ERROR(views);
        wide.views = std::move(*views);
    }
    auto found = source.find(wide, context);
    RETURN_IF_ERROR(found);
    const bool all = found->best.size() < wide.options.k;
    std::vector<Candidate> order = std::move(found->best);
    if (traits->ofOneSide) order = withViewsFirst(order, found->byViews, most);
    if (options.grouping) {
        auto ofGroups = allOfGroups(source, wide.options, std::move(found->ofGroups), context);
        RETURN_IF_ERROR(ofGroups);
        order = withGroups(order, std::move(*ofGroups), most);
    }
    auto result = Verifier(source, *traits, options, context).run(order, most, all);
    RETURN_IF_ERROR(result);
    result->counts = found->counts;
    return result;
}

}  // namespace

Result<VerifiedResult> topKVerified(const Signature& query, const SurfacePoints& surface,
                                    const CandidateSource& source, const SearchOptions& options,
                                    const VerifyOptions& verify, const RunContext& context) {
    return timed(source, options, [&] { return verified(query, surface, source, options, verify, context); });
}

Result<VerifiedResult> topKVerified(const Signature& query, const SurfacePoints& surface,
                                    const SignatureSet& set, const SearchOptions& options,
                                    const VerifyOptions& verify, const SurfaceOf& surfaceOf,
                                    const RunContext& context) {
    RETURN_IF_ERROR(validate(options));
    const auto source = SetCandidates::make(query, &surface, options.score, set, surfaceOf);
    RETURN_IF_ERROR(source);
    return topKVerified(query, surface, *source, options, verify, context);
}

Result<VerifiedResult> topKUnverified(const CandidateSource& source, const SearchOptions& options,
                                      const RunContext& context) {
    return timed(source, options, [&]() -> Result<VerifiedResult> {
        CandidateSearch search{options};
        search.groups = options.grouping.has_value();
        search.best = !search.groups;
        auto found = source.find(search, context);
        RETURN_IF_ERROR(found);
        std::vector<Candidate> hits = std::move(found->best);
        if (options.grouping) {
            auto ofGroups = allOfGroups(source, options, std::move(found->ofGroups), context);
            RETURN_IF_ERROR(ofGroups);
            hits = std::move(*ofGroups);
        }
        VerifiedResult result;
        for (Candidate& hit : hits) {
            result.hits.push_back(
                {hit.id, hit.score, hit.score, nullptr, Verdict::kNone, std::move(hit.group), hit.quality});
        }
        result.exact = true;
        result.counts = found->counts;
        return result;
    });
}

}  // namespace shapedb
