// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/top_k.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/number_text.h"
#include "core/base/return_if_error.h"
#include "core/search/signature_block.h"

namespace shapedb {

namespace {

// Blocks that are searched before the best scores so far are used against the next, larger slice.
constexpr std::size_t kFirstSlice = 4;
constexpr std::size_t kSliceGrowth = 8;

// Candidates that are scored before the best scores so far are used against the rest.
constexpr std::size_t kFirstChunk = 32;
constexpr std::size_t kLargestChunk = 1024;

// Candidates that one thread takes at a time.
constexpr std::size_t kGrain = 4;

// A row that the scan of its block left. Small, for it is sorted.
struct Contender {
    double bound = 0.0;
    const Survivor* survivor = nullptr;
    const SignatureBlock* block = nullptr;
    GroupValue group = nullptr;  ///< of searches with groups

    std::int64_t id() const { return block->id(survivor->row); }
};

// A hit so far.
struct RankedHit : SearchHit {
    GroupValue group = nullptr;
};

struct BlockScan {
    std::vector<Survivor> left;
    std::uint64_t filtered = 0;
    ScanCounts counts;
};

bool ranksBefore(const SearchHit& a, const SearchHit& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
}

bool visitedBefore(const Contender& a, const Contender& b) {
    return a.bound != b.bound ? a.bound > b.bound : a.id() < b.id();
}

}  // namespace

Result<void> validate(const SearchOptions& options) {
    if (options.k == 0) return fail(ErrorCode::kInvalidArgument, "k is 0; ask for at least 1 hit");
    if (!(options.threshold >= 0.0 && options.threshold <= 1.0)) {
        return fail(ErrorCode::kInvalidArgument,
                    "threshold is " + numberText(options.threshold) + "; it must be 0 to 1");
    }
    if (options.grouping && options.grouping->perGroup == 0) {
        return fail(ErrorCode::kInvalidArgument, "0 hits of a group; ask for at least 1");
    }
    return {};
}

namespace {

Result<void> check(const Signature& query, const SignatureSet& set, const SearchOptions& options) {
    RETURN_IF_ERROR(validate(options));
    RETURN_IF_ERROR(checkQuery(query, set.attributedCount()));
    return validate(options.score);
}

// Runs work(i) for begin <= i < end in parallel until the context stops it.
template <typename Work>
Result<void> parallelUntilStopped(std::size_t begin, std::size_t end, std::size_t grain,
                                  const RunContext& context, const Work& work) {
    std::atomic<bool> stop{false};
    const auto runRange = [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            if (stop.load(std::memory_order_relaxed)) return;
            if (!context.checkpoint()) {
                stop = true;
                return;
            }
            work(i);
        }
    };
    // Isolated: a search that waits for its last range must not begin another one of the same arena.
    tbb::this_task_arena::isolate(
        [&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, grain), runRange); });
    return context.checkpoint();
}

// Climbs the scorer's ladder of bounds (for attributed shapes from the statistics, 256 bytes each, to the
// full score), each rung only for the candidates that the one before left. A small share of the snapshot
// comes first: its best scores then rule out most of the rest.
//
// With groups, what a candidate needs depends on its group too: to beat the last hit of a full one. The
// groups of the best k hits of which no two are of one group come first; then, `only` among these, more hits
// of each. (Both at once would lose hits: a group may fall behind and come back by a better hit, when its
// others are forgotten.)
class Searcher {
  public:
    Searcher(const Scorer& scorer, const SignatureSet& set, const SearchOptions& options,
             std::size_t perGroup, const std::vector<GroupValue>* only, const RunContext& context)
        : scorer_(scorer), options_(options), context_(context), perGroup_(perGroup) {
        if (only != nullptr) {
            only_.emplace();
            for (const GroupValue group : *only) (*only_)[group] = true;
        }
        result_.counts.candidates = set.size();
        // Each slice is spread evenly over the set: shapes that were added together are often alike.
        order_.reserve(set.blocks().size());
        std::size_t stride = 1;
        while (stride * kFirstSlice < set.blocks().size()) stride *= 2;
        const auto takeEvery = [&](std::size_t step, std::size_t first) {
            for (std::size_t b = first; b < set.blocks().size(); b += step) {
                order_.push_back(set.blocks()[b].get());
            }
        };
        takeEvery(stride, 0);
        for (; stride > 1; stride /= 2) takeEvery(stride, stride / 2);
    }

    Result<SearchResult> run() {
        RETURN_IF_ERROR(context_.checkpoint());
        std::size_t slice = kFirstSlice;
        for (std::size_t begin = 0; begin < order_.size();) {
            const std::size_t end = std::min(order_.size(), begin + slice);
            const auto scans = scanSlice(begin, end);
            RETURN_IF_ERROR(scans);
            RETURN_IF_ERROR(visit(collect(*scans, begin)));
            begin = end;
            // The k-th score changes less and less, so later slices can be larger.
            slice *= kSliceGrowth;
            blocksDone_ = end;
        }
        return std::move(result_);
    }

    // In the order of their rank.
    const std::vector<RankedHit>& hits() const { return hits_; }

  private:
    // Candidates that score less are no hits, whatever their group.
    double needed() const {
        if (!only_) return hits_.size() == options_.k ? hits_.back().score : options_.threshold;
        return lastOfFull_.size() == only_->size() ? leastOfFull_ : options_.threshold;
    }

    // Of a candidate of this group, given what any needs.
    double neededIn(GroupValue group, double least) const {
        if (!options_.grouping) return least;
        const double* last = lastOfFull_.find(group);
        return last != nullptr ? std::max(least, *last) : least;
    }

    BlockScan scanBlock(const SignatureBlock& block, double least) const {
        BlockScan scan;
        std::vector<std::uint8_t> wanted = wantedRows(block, options_.filter, options_.excludeId);
        if (only_) keepGroups(block, wanted);
        scan.filtered = wanted.empty()
                            ? block.size()
                            : static_cast<std::uint64_t>(std::count(wanted.begin(), wanted.end(), 1));
        if (scan.filtered > 0) scorer_.scan(block.rows(), wanted, least, scan.left, scan.counts);
        return scan;
    }

    // Takes the rows of other groups out of `wanted`, in which an empty one means all.
    void keepGroups(const SignatureBlock& block, std::vector<std::uint8_t>& wanted) const {
        wanted.resize(block.size(), wanted.empty() ? 1 : 0);
        for (std::size_t row = 0; row < block.size(); ++row) {
            if (wanted[row] != 0 && only_->find(groupOf(block, row, options_.grouping->key)) == nullptr) {
                wanted[row] = 0;
            }
        }
    }

    Result<std::vector<BlockScan>> scanSlice(std::size_t begin, std::size_t end) const {
        std::vector<BlockScan> scans(end - begin);
        // The same for the whole slice, so that what its blocks leave does not depend on which is scanned
        // first.
        const double least = needed();
        auto done = parallelUntilStopped(
            begin, end, 1, context_, [&](std::size_t b) { scans[b - begin] = scanBlock(*order_[b], least); });
        RETURN_IF_ERROR(done);
        return scans;
    }

    // Counts what the scans of the blocks from `begin` left, and puts it in the order of visiting.
    std::vector<Contender> collect(const std::vector<BlockScan>& scans, std::size_t begin) {
        std::size_t left = 0;
        for (const BlockScan& scan : scans) {
            left += scan.left.size();
            result_.counts.filtered += scan.filtered;
            result_.counts.scans += scan.counts;
        }
        std::vector<Contender> all;
        all.reserve(left);
        for (std::size_t b = 0; b < scans.size(); ++b) {
            for (const Survivor& survivor : scans[b].left) {
                // Points into `scans`, which live until all candidates have been visited.
                const SignatureBlock* block = order_[begin + b];
                const GroupValue group =
                    options_.grouping ? groupOf(*block, survivor.row, options_.grouping->key) : nullptr;
                all.push_back({survivor.bound, &survivor, block, group});
            }
        }
        std::sort(all.begin(), all.end(), visitedBefore);
        return all;
    }

    // Scores candidates by falling bound until no bound reaches the k-th score.
    Result<void> visit(const std::vector<Contender>& candidates) {
        std::size_t chunk = kFirstChunk;
        for (std::size_t begin = 0; begin < candidates.size();) {
            const double least = needed();
            // A candidate whose bound equals the k-th score may still win by its smaller id.
            std::size_t end = begin;
            while (end < candidates.size() && end - begin < chunk && candidates[end].bound >= least) {
                ++end;
            }
            if (end == begin) break;
            RETURN_IF_ERROR(scoreChunk(candidates, begin, end, least));
            begin = end;
            chunk = std::min(chunk * 2, kLargestChunk);
            context_.report("search", blocksDone_, order_.size());
        }
        return {};
    }

    Result<void> scoreChunk(const std::vector<Contender>& candidates, std::size_t begin, std::size_t end,
                            double least) {
        std::vector<std::optional<double>> scores(end - begin);
        // Before any is scored: what a candidate needs must not depend on which thread is faster.
        std::vector<double> neededOf(end - begin);
        for (std::size_t i = begin; i < end; ++i) {
            neededOf[i - begin] = neededIn(candidates[i].group, least);
        }
        // A signature of many points takes milliseconds, so every one is preceded by a look at the context.
        auto done = parallelUntilStopped(begin, end, kGrain, context_, [&](std::size_t i) {
            const Contender& candidate = candidates[i];
            const double own = neededOf[i - begin];
            if (candidate.bound < own) return;
            const ShapeRow shape = candidate.block->rows()[candidate.survivor->row];
            scores[i - begin] = scorer_.scoreIfReaches(shape, *candidate.survivor, own);
        });
        RETURN_IF_ERROR(done);
        for (std::size_t i = begin; i < end; ++i) {
            const std::optional<double> score = scores[i - begin];
            if (!score) continue;
            ++result_.counts.scored;
            if (*score >= options_.threshold) {
                hits_.push_back({{candidates[i].id(), *score}, candidates[i].group});
            }
        }
        std::sort(hits_.begin(), hits_.end(), ranksBefore);
        if (options_.grouping) {
            keepBestOfGroups(hits_, options_.k, perGroup_, [](const RankedHit& hit) { return hit.group; });
            noteFullGroups();
        } else if (hits_.size() > options_.k) {
            hits_.resize(options_.k);
        }
        return {};
    }

    void noteFullGroups() {
        GroupMap<std::size_t> counts;
        lastOfFull_.clear();
        for (const RankedHit& hit : hits_) {
            if (++counts[hit.group] < perGroup_) continue;
            lastOfFull_[hit.group] = hit.score;
            leastOfFull_ = hit.score;  // the hits come best first
        }
    }

    const Scorer& scorer_;
    const SearchOptions& options_;
    const RunContext& context_;
    std::vector<const SignatureBlock*> order_;
    std::size_t blocksDone_ = 0;
    SearchResult result_;  // without its hits
    std::vector<RankedHit> hits_;
    const std::size_t perGroup_;
    std::optional<GroupMap<bool>> only_;
    GroupMap<double> lastOfFull_;  // score of the last hit of each group that has all it may have
    double leastOfFull_ = 0.0;     // the least of these
};

// `only`: see Searcher.
Result<SearchResult> searchFor(const Scorer& scorer, const SignatureSet& set, const SearchOptions& options,
                               std::size_t perGroup, const std::vector<GroupValue>* only,
                               const RunContext& context) {
    Searcher searcher(scorer, set, options, perGroup, only, context);
    auto result = searcher.run();
    RETURN_IF_ERROR(result);
    result->hits.assign(searcher.hits().begin(), searcher.hits().end());
    return result;
}

Result<SearchResult> searchInGroups(const Scorer& scorer, const SignatureSet& set,
                                    const SearchOptions& options, const RunContext& context) {
    auto result = searchFor(scorer, set, options, 1, nullptr, context);
    RETURN_IF_ERROR(result);
    const std::size_t perGroup = options.grouping->perGroup;
    if (perGroup == 1 || result->hits.empty()) return result;
    const auto groupOfHit = [&](const SearchHit& hit) { return groupOf(set, hit.id, options.grouping->key); };
    std::vector<GroupValue> groups;
    for (const SearchHit& hit : result->hits) groups.push_back(groupOfHit(hit));
    auto more = searchFor(scorer, set, options, perGroup, &groups, context);
    RETURN_IF_ERROR(more);
    bringGroupsTogether(more->hits, groupOfHit);
    result->hits = std::move(more->hits);
    return result;
}

Result<SearchResult> outOfMemory(const SignatureSet& set) {
    return fail(ErrorCode::kOutOfMemory,
                "not enough memory to search " + std::to_string(set.size()) + " signatures");
}

}  // namespace

Result<SearchResult> topK(const Signature& query, const SignatureSet& set, const SearchOptions& options,
                          const RunContext& context) {
    RETURN_IF_ERROR(check(query, set, options));
    try {
        std::shared_ptr<const Scorer> scorer = makeScorer(query, options.score);
        auto result = topK(*scorer, set, options, context);
        if (result) result->scorer = std::move(scorer);
        return result;
    } catch (const std::bad_alloc&) {
        return outOfMemory(set);
    }
}

namespace {

// Runs a search, times it, and makes errors of what it throws.
template <typename Search>
Result<SearchResult> timed(const SignatureSet& set, const SearchOptions& options, const Search& search) {
    RETURN_IF_ERROR(validate(options));
    try {
        const auto began = RunContext::Clock::now();
        Result<SearchResult> result = search();
        if (result) result->seconds = std::chrono::duration<double>(RunContext::Clock::now() - began).count();
        return result;
    } catch (const std::bad_alloc&) {
        return outOfMemory(set);
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("search: ") + e.what());
    }
}

}  // namespace

Result<SearchResult> topK(const Scorer& scorer, const SignatureSet& set, const SearchOptions& options,
                          const RunContext& context) {
    return timed(set, options, [&] {
        return options.grouping ? searchInGroups(scorer, set, options, context)
                                : searchFor(scorer, set, options, 1, nullptr, context);
    });
}

Result<SearchResult> bestOfGroups(const Scorer& scorer, const SignatureSet& set, const SearchOptions& options,
                                  const RunContext& context) {
    return timed(set, options, [&] { return searchFor(scorer, set, options, 1, nullptr, context); });
}

Result<SearchResult> hitsOfGroups(const Scorer& scorer, const SignatureSet& set, const SearchOptions& options,
                                  const std::vector<GroupValue>& groups, const RunContext& context) {
    // As many groups as are asked for, however few hits the search that found them was to have.
    SearchOptions own = options;
    own.k = std::max<std::size_t>(1, groups.size());
    return timed(set, own,
                 [&] { return searchFor(scorer, set, own, own.grouping->perGroup, &groups, context); });
}

Error ofQuery(std::size_t i, Error error) {
    return withContext(std::move(error), "query " + std::to_string(i) + ": ");
}

Result<std::vector<SearchResult>> topKBatch(const std::vector<BatchQuery>& queries, const SignatureSet& set,
                                            const SearchOptions& options, const RunContext& context) {
    try {
        std::vector<Result<SearchResult>> found(queries.size(), SearchResult{});
        std::atomic<bool> failed{false};
        const auto runRange = [&](const tbb::blocked_range<std::size_t>& range) {
            // Each query on one thread: what it spreads over several it would have to wait for.
            tbb::task_arena alone(1);
            for (std::size_t q = range.begin(); q < range.end() && !failed.load(); ++q) {
                SearchOptions own = options;
                own.excludeId = queries[q].excludeId;
                found[q] = alone.execute([&] { return topK(queries[q].signature, set, own, context); });
                if (!found[q]) failed = true;
            }
        };
        // Isolated, as above.
        tbb::this_task_arena::isolate(
            [&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(0, queries.size(), 1), runRange); });
        std::vector<SearchResult> results;
        results.reserve(queries.size());
        for (std::size_t q = 0; q < found.size(); ++q) {
            if (!found[q]) return fail(ofQuery(q, found[q].error()));
            results.push_back(std::move(*found[q]));
        }
        return results;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory for " + std::to_string(queries.size()) + " searches at once");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("search: ") + e.what());
    }
}

}  // namespace shapedb
