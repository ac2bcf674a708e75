#include "core/search/top_k.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <new>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace shapedb {

namespace {

struct Candidate {
    double bound = 0.0;
    const SignatureSet::EntryPtr* entry = nullptr;
};

bool ranksBefore(const SearchHit& a, const SearchHit& b) {
    return a.score != b.score ? a.score > b.score : a.entry->id < b.entry->id;
}

Result<void> checkOptions(const SearchOptions& options) {
    if (options.k == 0) return fail(ErrorCode::kInvalidArgument, "k is 0; ask for at least 1 hit");
    if (!(options.threshold >= 0.0 && options.threshold <= 1.0)) {
        return fail(ErrorCode::kInvalidArgument,
                    "threshold is " + std::to_string(options.threshold) + "; it must be 0 to 1");
    }
    return validate(options.score);
}

// What passes filter and exclusion, with its upper bound.
Result<std::vector<Candidate>> boundCandidates(const Signature& query, const SignatureSet& set,
                                               const SearchOptions& options, const RunContext& context) {
    std::vector<std::vector<Candidate>> perBlock(set.blocks().size());
    std::atomic<bool> stop{false};
    tbb::parallel_for(std::size_t{0}, set.blocks().size(), [&](std::size_t b) {
        if (stop.load(std::memory_order_relaxed)) return;
        if (!context.checkpoint()) {
            stop = true;
            return;
        }
        for (const auto& entry : *set.blocks()[b]) {
            if (options.excludeId && entry->id == *options.excludeId) continue;
            if (!options.filter.matches(entry->metadata)) continue;
            perBlock[b].push_back({scoreUpperBound(query, entry->signature, options.score), &entry});
        }
    });
    if (auto go = context.checkpoint(); !go) return fail(go.error());
    std::vector<Candidate> all;
    for (const auto& block : perBlock) all.insert(all.end(), block.begin(), block.end());
    return all;
}

// Scores candidates[begin, end) in parallel. Signatures of many points take milliseconds each, so
// a stop is looked for before each.
Result<void> scoreChunk(const Signature& query, const std::vector<Candidate>& candidates, std::size_t begin,
                        std::size_t end, const ScoreOptions& options, std::vector<double>& scores,
                        const RunContext& context) {
    scores.resize(end - begin);
    std::atomic<bool> stop{false};
    tbb::parallel_for(begin, end, [&](std::size_t i) {
        if (stop.load(std::memory_order_relaxed)) return;
        if (!context.checkpoint()) {
            stop = true;
            return;
        }
        scores[i - begin] = score(query, (*candidates[i].entry)->signature, options);
    });
    return context.checkpoint();
}

Result<SearchResult> searchOrThrow(const Signature& query, const SignatureSet& set,
                                   const SearchOptions& options, const RunContext& context) {
    SearchResult result;
    result.candidates = set.size();
    auto candidates = boundCandidates(query, set, options, context);
    if (!candidates) return fail(candidates.error());
    result.filtered = candidates->size();
    std::sort(candidates->begin(), candidates->end(), [](const Candidate& a, const Candidate& b) {
        return a.bound != b.bound ? a.bound > b.bound : (*a.entry)->id < (*b.entry)->id;
    });
    // Chunks grow: small at first, while the k-th score rises fast, then large for the cores.
    std::vector<double> scores;
    std::size_t chunk = 32;
    for (std::size_t begin = 0; begin < candidates->size();) {
        const bool full = result.hits.size() == options.k;
        const double needed = full ? result.hits.back().score : options.threshold;
        // A candidate whose bound equals the k-th score may still win by its smaller id.
        std::size_t end = begin;
        while (end < candidates->size() && end - begin < chunk && (*candidates)[end].bound >= needed) ++end;
        if (end == begin) break;
        if (auto done = scoreChunk(query, *candidates, begin, end, options.score, scores, context); !done) {
            return fail(done.error());
        }
        result.scored += end - begin;
        for (std::size_t i = begin; i < end; ++i) {
            if (scores[i - begin] >= options.threshold) {
                result.hits.push_back({*(*candidates)[i].entry, scores[i - begin]});
            }
        }
        std::sort(result.hits.begin(), result.hits.end(), ranksBefore);
        if (result.hits.size() > options.k) result.hits.resize(options.k);
        begin = end;
        chunk = std::min<std::size_t>(chunk * 2, 4096);
        context.report("search", begin, candidates->size());
    }
    return result;
}

}  // namespace

Result<SearchResult> topK(const Signature& query, const SignatureSet& set, const SearchOptions& options,
                          const RunContext& context) {
    if (auto valid = checkOptions(options); !valid) return fail(valid.error());
    try {
        return searchOrThrow(query, set, options, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to search " + std::to_string(set.size()) + " signatures");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("search: ") + e.what());
    }
}

}  // namespace shapedb
