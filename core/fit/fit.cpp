// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <new>
#include <utility>

#include "core/base/math.h"
#include "core/base/return_if_error.h"
#include "core/fit/comparison.h"
#include "core/fit/free_axes.h"
#include "core/fit/hypotheses.h"

namespace shapedb {

namespace {

// Stages: many poses by a few points, fewer by more points, and so on. Widths are shares of the query's
// diagonal.
constexpr std::size_t kPromising = 160;
constexpr std::size_t kPromisingPoints = 128;
constexpr float kPromisingWidth = 0.05f;
constexpr double kApart = 0.05;  // poses closer than this lead to the same end

struct Stage {
    std::size_t poses;   // that enter it
    std::size_t points;  // of each shape
    double leastShare;   // of the best score, of poses that enter it
    int steps;
    float from;  // widths of the kernel
    float to;
    float judged;  // width by which the poses are sorted afterwards
    bool turns;    // whether turned poses are added then
};
constexpr Stage kStages[] = {
    {32, 96, 0.3, 5, 0.15f, 0.07f, 0.04f, true},
    {12, 256, 0.65, 6, 0.07f, 0.035f, 0.02f, false},
    {4, 512, 0.85, 10, 0.035f, 0.02f, 0.02f, false},
};

// The others that enter the last stage, and one of the other hand.
static_assert(std::end(kStages)[-1].poses == kMostAlternatives);

constexpr std::size_t kTurnedPoses = 2;
constexpr int kTurns = 24;

constexpr float kScoreWidth = 0.02f;
constexpr float kResidualWithin = 0.06f;

// Poses further apart than kDifferent differ clearly; one whose score is at least kAsGood times the best is
// as good.
constexpr double kDifferent = 0.04;
constexpr double kAsGood = 0.97;

// As kAsGood, for a mirrored pose and one that is not: closer than the scores of two scans of one object.
constexpr double kHandsAlike = 0.99;

// By FitKind.
constexpr std::array<double, 3> kTypicalMisfit{0.70, 0.65, 0.60};
constexpr std::array<FitKind, 3> kKinds{FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece};

// The least 1 - F of two clean scans of one object.
constexpr double kScansApart = 0.06;

// From this score of whole shapes on, no other kind is tried.
constexpr double kWholeEnough = 0.85;

// Of the diagonals of two shapes whose scales are kept.
constexpr double kMostRatio = 1000.0;

struct Candidate {
    Motion pose;
    FitView view;
    Shares shares;

    double score() const { return shares.score(); }
};

// Best first; equal scores keep their order.
void sortByScore(std::vector<Candidate>& candidates) {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); });
}

// The first `most` that are at least `apart` from all before them.
std::vector<Candidate> distinct(const std::vector<Candidate>& sorted, std::size_t most, double apart,
                                const Comparison& comparison) {
    std::vector<Candidate> chosen;
    for (const Candidate& c : sorted) {
        if (chosen.size() == most) break;
        const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
            return comparison.apart(c.pose, other.pose) < apart;
        });
        if (!known) chosen.push_back(c);
    }
    return chosen;
}

// Shapes that look alike when turned (a cup without its handle, a table, an octopus) are stuck in the wrong
// turn: adds the best poses turned about the axes of the other shape.
void addTurned(std::vector<Candidate>& sorted, Comparison& comparison, const Stage& stage) {
    const std::size_t seeds = std::min(kTurnedPoses, sorted.size());
    for (std::size_t i = 0; i < seeds; ++i) {
        for (const TurnAxis& axis : axesOf(comparison, sorted[i].pose)) {
            for (int step = 1; step < kTurns; ++step) {
                Candidate c = sorted[i];
                c.pose = turnedAbout(axis, 2.0 * kPi * step / kTurns, c.pose);
                c.shares = comparison.shares(c.pose, c.view, stage.points, stage.judged);
                sorted.push_back(c);
            }
        }
    }
    sortByScore(sorted);
}

// The poses that enter a stage: the best ones, and the best of the other hand if all of them are of one hand,
// so that at the end it is known how much worse that is.
std::vector<Candidate> enter(const Stage& stage, const std::vector<Candidate>& sorted,
                             const Comparison& comparison) {
    const double least = stage.leastShare * sorted.front().score();
    const auto end =
        std::find_if(sorted.begin(), sorted.end(), [&](const Candidate& c) { return !(c.score() >= least); });
    auto chosen = distinct({sorted.begin(), end}, stage.poses, kApart, comparison);
    const bool mirrored = chosen.front().pose.reflected;
    const auto otherHand = [&](const Candidate& c) { return c.pose.reflected != mirrored; };
    if (std::none_of(chosen.begin(), chosen.end(), otherHand)) {
        const auto best = std::find_if(sorted.begin(), sorted.end(), otherHand);
        if (best != sorted.end()) chosen.push_back(*best);
    }
    return chosen;
}

// All stages for one kind: fitted poses, best first, none less than kDifferent from a better one. None at all
// where no pose that was tried brings the shapes near each other, as of very different sizes that are kept.
Result<std::vector<Candidate>> candidatesOf(Comparison& comparison, FitKind kind, const FitOptions& options,
                                            const RunContext& context) {
    const auto promising =
        promisingPoses(comparison.query(), comparison.other(), kind, options, kPromising, context);
    RETURN_IF_ERROR(promising);
    RETURN_IF_ERROR(context.checkpoint());
    std::vector<Candidate> candidates;
    if (promising->empty()) return candidates;
    for (const Hypothesis& h : *promising) {
        candidates.push_back(
            {h.pose, h.view, comparison.shares(h.pose, h.view, kPromisingPoints, kPromisingWidth)});
    }
    sortByScore(candidates);
    for (const Stage& stage : kStages) {
        candidates = enter(stage, candidates, comparison);
        for (Candidate& c : candidates) {
            RETURN_IF_ERROR(context.checkpoint());
            c.pose = comparison.refined(c.pose, c.view, options.keepScale, stage.points, stage.steps,
                                        stage.from, stage.to);
            c.shares = comparison.shares(c.pose, c.view, 2 * stage.points, stage.judged);
        }
        sortByScore(candidates);
        if (stage.turns) addTurned(candidates, comparison, stage);
    }
    for (Candidate& c : candidates)
        c.shares = comparison.shares(c.pose, c.view, kMostSurfacePoints, kScoreWidth);
    sortByScore(candidates);
    return distinct(candidates, candidates.size(), kDifferent, comparison);
}

double misfitOf(double score, FitKind kind) {
    return std::max(0.0, 1.0 - score - kScansApart) / (typicalMisfit(kind) - kScansApart);
}
double misfitOf(const Candidate& c) { return misfitOf(c.score(), c.view.kind); }

FitPose poseOf(const Candidate& c, Comparison& comparison, bool keepScale) {
    FitPose pose;
    pose.motion = compose(comparison.query().toScan, compose(c.pose, inverse(comparison.other().toScan)));
    if (keepScale) pose.motion.scale = 1.0;
    pose.score = c.score();
    pose.explainedQuery = c.shares.query;
    pose.explainedOther = c.shares.other;
    pose.residual = comparison.residual(c.pose, kResidualWithin);
    return pose;
}

// Where the points do not tell left from right, the best unmirrored pose comes first; returns whether that is
// so.
bool unmirroredFirst(std::vector<Candidate>& candidates) {
    const bool mirrored = candidates.front().pose.reflected;
    const auto other = std::find_if(candidates.begin(), candidates.end(),
                                    [&](const Candidate& c) { return c.pose.reflected != mirrored; });
    if (other == candidates.end() || other->score() < kHandsAlike * candidates.front().score()) return false;
    if (mirrored) std::rotate(candidates.begin(), other, other + 1);
    return true;
}

FitResult resultOf(std::vector<Candidate> candidates, Comparison& comparison, const FitOptions& options) {
    FitResult result;
    result.handednessOpen = unmirroredFirst(candidates);
    const Candidate& best = candidates.front();
    result.kind = best.view.kind;
    result.best = poseOf(best, comparison, options.keepScale);
    const std::vector<TurnAxis> axes = freeAxes(comparison, best.pose, best.view);
    for (const TurnAxis& axis : axes) {
        const Motion& toScan = comparison.query().toScan;
        result.axes.push_back({apply(toScan, axis.point), rotate(toScan.rotation, axis.direction)});
    }
    double second = 0.0;
    for (std::size_t i = 1; i < candidates.size(); ++i) {
        const Candidate& c = candidates[i];
        if (isTurned(comparison, best.pose, c.pose, axes, kDifferent)) continue;
        second = std::max(second, c.score());
        if (c.score() < kAsGood * best.score()) continue;
        result.alternatives.push_back(poseOf(c, comparison, options.keepScale));
    }
    const double score = best.score();
    result.misfit = misfitOf(best);
    result.certainty = score > 0.0 ? std::clamp(1.0 - second / score, 0.0, 1.0) : 0.0;
    return result;
}

// Shapes that no pose brings near each other, or sizes so different that neither is more than a point on the
// other, and that single precision may not hold both: middle on middle.
FitResult unlike(const FitQuery& query, const FitPoints& other, const FitOptions& options) {
    FitResult result;
    result.kind =
        *std::find_if(kKinds.begin(), kKinds.end(), [&](FitKind kind) { return options.kinds.allows(kind); });
    result.misfit = misfitOf(0.0, result.kind);
    result.best.motion.translation = query.points().toScan.translation - other.toScan.translation;
    return result;
}

Result<FitResult> fitOrThrow(const FitQuery& query, const SurfacePoints& other, const FitOptions& options,
                             const RunContext& context) {
    RETURN_IF_ERROR(context.checkpoint());
    const FitPoints candidate(other);
    const double ratio = candidate.toScan.scale / query.diagonal();
    if (options.keepScale && !(ratio < kMostRatio && ratio * kMostRatio > 1.0)) {
        return unlike(query, candidate, options);
    }
    Comparison comparison(query.points(), candidate);
    std::vector<FitKind> kinds;
    std::copy_if(kKinds.begin(), kKinds.end(), std::back_inserter(kinds),
                 [&](FitKind kind) { return options.kinds.allows(kind); });
    std::vector<Candidate> best;
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        context.report("fit", i, kinds.size());
        auto found = candidatesOf(comparison, kinds[i], options, context);
        RETURN_IF_ERROR(found);
        if (found->empty()) continue;
        if (best.empty() || misfitOf(found->front()) < misfitOf(best.front())) best = std::move(*found);
        if (kinds[i] == FitKind::kWhole && best.front().score() >= kWholeEnough) break;
    }
    context.report("fit", kinds.size(), kinds.size());
    if (best.empty()) return unlike(query, candidate, options);
    return resultOf(std::move(best), comparison, options);
}

}  // namespace

FitKinds FitKinds::only(FitKind kind) {
    return {kind == FitKind::kWhole, kind == FitKind::kOneSided, kind == FitKind::kPiece};
}

bool FitKinds::allows(FitKind kind) const {
    switch (kind) {
        case FitKind::kWhole: return whole;
        case FitKind::kOneSided: return oneSided;
        case FitKind::kPiece: return piece;
    }
    return false;
}

double typicalMisfit(FitKind kind) noexcept { return kTypicalMisfit[static_cast<std::size_t>(kind)]; }

FitQuery::FitQuery(const SurfacePoints& surface) {
    auto points = std::make_shared<FitPoints>(surface);
    points->findHull();
    points_ = std::move(points);
}

double FitQuery::diagonal() const { return points_->toScan.scale; }

Result<FitResult> fit(const FitQuery& query, const SurfacePoints& other, const FitOptions& options,
                      const RunContext& context) {
    try {
        return fitOrThrow(query, other, options, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to align two shapes");
    }
}

Result<FitResult> preferUnmirrored(FitResult found, const FitQuery& query, const SurfacePoints& other,
                                   const FitOptions& options, const RunContext& context) {
    if (!found.best.motion.reflected) return found;
    FitOptions unmirrored = options;
    unmirrored.reflection = false;
    unmirrored.kinds = FitKinds::only(found.kind);
    auto result = fit(query, other, unmirrored, context);
    RETURN_IF_ERROR(result);
    if (result->best.score < kHandsAlike * found.best.score) return found;
    result->handednessOpen = true;
    result->misfit = found.misfit;
    return result;
}

Result<FitResult> align(const FitQuery& query, const SurfacePoints& other, const FitOptions& options,
                        const RunContext& context) {
    auto found = fit(query, other, options, context);
    RETURN_IF_ERROR(found);
    return preferUnmirrored(std::move(*found), query, other, options, context);
}

}  // namespace shapedb
