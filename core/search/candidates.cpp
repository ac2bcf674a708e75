// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/candidates.h"

#include <algorithm>
#include <iterator>
#include <new>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/search/view_search.h"

namespace shapedb {

namespace {

bool isBetter(const Candidate& a, const Candidate& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
}

}  // namespace

std::optional<double> qualityOf(const SignatureBlock& block, std::size_t row) {
    if (!block.attributed(row)) return std::nullopt;
    return block.quality(row) / 255.0;
}

Result<SetCandidates> SetCandidates::make(const Signature& query, const SurfacePoints* querySurface,
                                          const ScoreOptions& score, const SignatureSet& set,
                                          const SurfaceOf& surfaceOf) {
    RETURN_IF_ERROR(checkQuery(query, set.attributedCount()));
    RETURN_IF_ERROR(validate(score));
    try {
        SetCandidates candidates(makeScorer(query, score), set, surfaceOf);
        if (querySurface != nullptr) candidates.laidOn_.emplace(*querySurface);
        return candidates;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to search " + std::to_string(set.size()) + " signatures");
    }
}

Candidate SetCandidates::candidate(const SearchHit& hit, const std::optional<Grouping>& grouping) const {
    const SignatureSet::Place place = set_.find(hit.id);
    Candidate candidate{hit.id, hit.score, nullptr, qualityOf(*place.block, place.row)};
    if (grouping) {
        const GroupValue group = groupOf(*place.block, place.row, grouping->key);
        if (group != nullptr) candidate.group = std::make_shared<const std::string>(*group);
    }
    return candidate;
}

std::vector<Candidate> SetCandidates::candidates(const std::vector<SearchHit>& hits,
                                                 const std::optional<Grouping>& grouping) const {
    std::vector<Candidate> all;
    all.reserve(hits.size());
    for (const SearchHit& hit : hits) all.push_back(candidate(hit, grouping));
    return all;
}

Result<Candidates> SetCandidates::find(const CandidateSearch& search, const RunContext& context) const {
    Candidates found;
    if (search.best) {
        SearchOptions any = search.options;
        any.grouping.reset();
        auto best = topK(*scorer_, set_, any, context);
        RETURN_IF_ERROR(best);
        found.best = candidates(best->hits, search.options.grouping);
        found.counts = best->counts;
    }
    if (search.views) {
        const auto near =
            nearestByViews(ViewQuery(search.views->view, search.views->options), set_, search.views->count,
                           search.options.filter, search.options.excludeId, context);
        RETURN_IF_ERROR(near);
        for (const ViewHit& hit : *near) {
            const SignatureSet::Place place = set_.find(hit.id);
            const ShapeRow row = place.block->rows()[place.row];
            const bool comparable = scorer_->compares(row);
            const SearchHit scored{hit.id, comparable ? scorer_->score(row) : 0.0};
            found.byViews.push_back({candidate(scored, search.options.grouping), hit.distance, comparable});
        }
    }
    if (search.groups) {
        auto best = bestOfGroups(*scorer_, set_, search.options, context);
        RETURN_IF_ERROR(best);
        found.ofGroups = candidates(best->hits, search.options.grouping);
        if (!search.best) found.counts = best->counts;
    }
    return found;
}

Result<std::vector<Candidate>> SetCandidates::findOfGroups(const SearchOptions& options,
                                                           const std::vector<OwnGroup>& groups,
                                                           const RunContext& context) const {
    std::vector<GroupValue> values;
    values.reserve(groups.size());
    for (const OwnGroup& group : groups) values.push_back(group.get());
    const auto found = hitsOfGroups(*scorer_, set_, options, values, context);
    RETURN_IF_ERROR(found);
    return candidates(found->hits, options.grouping);
}

/// body(i, surface's context) in parallel.
template <typename Body>
Result<std::vector<std::shared_ptr<const FitResult>>> SetCandidates::forEach(std::size_t count,
                                                                             const RunContext& context,
                                                                             const Body& body) const {
    // Its own progress would run backwards beside that of the others.
    RunContext quiet = context;
    quiet.progress = nullptr;
    using Fitted = std::shared_ptr<const FitResult>;
    std::vector<Result<Fitted>> outcomes(count, Fitted());
    RETURN_IF_ERROR(
        parallelFor(count, 1, context, [&](std::size_t i, std::size_t) { outcomes[i] = body(i, quiet); }));
    std::vector<Fitted> fits;
    fits.reserve(count);
    for (auto& outcome : outcomes) {
        RETURN_IF_ERROR(outcome);
        fits.push_back(std::move(*outcome));
    }
    return fits;
}

Result<std::vector<std::shared_ptr<const FitResult>>> SetCandidates::fitAll(
    const std::vector<std::int64_t>& ids, const FitOptions& options, const RunContext& context) const {
    using Fitted = std::shared_ptr<const FitResult>;
    return forEach(ids.size(), context, [&](std::size_t i, const RunContext& quiet) -> Result<Fitted> {
        const auto surface = surfaceOf_(ids[i]);
        RETURN_IF_ERROR(surface);
        if (*surface == nullptr) return Fitted();
        auto fitted = fit(*laidOn_, **surface, options, quiet);
        RETURN_IF_ERROR(fitted);
        return std::make_shared<const FitResult>(std::move(*fitted));
    });
}

Result<std::vector<std::shared_ptr<const FitResult>>> SetCandidates::preferUnmirroredAll(
    const std::vector<FittedShape>& shapes, const FitOptions& options, const RunContext& context) const {
    using Fitted = std::shared_ptr<const FitResult>;
    return forEach(shapes.size(), context, [&](std::size_t i, const RunContext& quiet) -> Result<Fitted> {
        const auto surface = surfaceOf_(shapes[i].id);
        RETURN_IF_ERROR(surface);
        if (*surface == nullptr) return shapes[i].fit;
        auto settled = preferUnmirrored(*shapes[i].fit, *laidOn_, **surface, options, quiet);
        RETURN_IF_ERROR(settled);
        return std::make_shared<const FitResult>(std::move(*settled));
    });
}

// Putting together -----------------------------------------------------------------------------

namespace {

template <typename T>
void append(std::vector<T>&& from, std::vector<T>& to) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

template <typename T>
void keepFirst(std::size_t count, std::vector<T>& all) {
    if (all.size() > count) all.erase(all.begin() + static_cast<std::ptrdiff_t>(count), all.end());
}

std::vector<Candidate> bestOfGroupsAmong(std::vector<Candidate> all, std::size_t groups,
                                         std::size_t perGroup) {
    std::sort(all.begin(), all.end(), isBetter);
    keepBestOfGroups(all, groups, perGroup, [](const Candidate& candidate) { return candidate.group.get(); });
    return all;
}

}  // namespace

Candidates merged(std::vector<Candidates> parts, const CandidateSearch& search) {
    Candidates all;
    for (Candidates& part : parts) {
        append(std::move(part.best), all.best);
        append(std::move(part.ofGroups), all.ofGroups);
        append(std::move(part.byViews), all.byViews);
        all.counts.candidates += part.counts.candidates;
        all.counts.filtered += part.counts.filtered;
        all.counts.scans += part.counts.scans;
        all.counts.scored += part.counts.scored;
    }
    std::sort(all.best.begin(), all.best.end(), isBetter);
    keepFirst(search.options.k, all.best);
    std::sort(all.byViews.begin(), all.byViews.end(), [](const ViewCandidate& a, const ViewCandidate& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.shape.id < b.shape.id;
    });
    if (search.views) keepFirst(search.views->count, all.byViews);
    all.ofGroups = bestOfGroupsAmong(std::move(all.ofGroups), search.options.k, 1);
    return all;
}

std::vector<Candidate> mergedOfGroups(std::vector<std::vector<Candidate>> parts, std::size_t groups,
                                      std::size_t perGroup) {
    std::vector<Candidate> all;
    for (std::vector<Candidate>& part : parts) append(std::move(part), all);
    return bestOfGroupsAmong(std::move(all), groups, perGroup);
}

}  // namespace shapedb
