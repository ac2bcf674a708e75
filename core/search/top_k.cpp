#include "core/search/top_k.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <new>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/return_if_error.h"
#include "core/search/statistics_bound.h"

namespace shapedb {

namespace {

// Blocks looked through before the best scores so far are used against the next, larger slice.
constexpr std::size_t kFirstSlice = 4;
constexpr std::size_t kSliceGrowth = 8;

// Candidates scored before the best scores so far are used against the rest.
constexpr std::size_t kFirstChunk = 32;
constexpr std::size_t kLargestChunk = 1024;

// Candidates that one thread takes at a time.
constexpr std::size_t kGrain = 4;

struct Candidate {
    double bound = 0.0;  // its score is no larger
    const SignatureBlock* block = nullptr;
    std::uint32_t row = 0;

    std::int64_t id() const { return block->id(row); }
};

struct BlockBounds {
    std::vector<Candidate> candidates;
    std::uint64_t filtered = 0;
    StatisticsBound::Counts counts;
};

bool ranksBefore(const SearchHit& a, const SearchHit& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
}

bool visitedBefore(const Candidate& a, const Candidate& b) {
    return a.bound != b.bound ? a.bound > b.bound : a.id() < b.id();
}

Result<void> check(const Signature& query, const SignatureSet& set, const SearchOptions& options) {
    if (options.k == 0) return fail(ErrorCode::kInvalidArgument, "k is 0; ask for at least 1 hit");
    if (!(options.threshold >= 0.0 && options.threshold <= 1.0)) {
        return fail(ErrorCode::kInvalidArgument,
                    "threshold is " + std::to_string(options.threshold) + "; it must be 0 to 1");
    }
    if (!query.attributes && set.attributedCount() > 0) {
        return fail(ErrorCode::kInvalidArgument,
                    "the query's signature has points and weights alone, those of the collection have "
                    "attributes: make the query's with the collection's profile");
    }
    return validate(options.score);
}

// Runs work(i) for begin <= i < end in parallel until the context stops it.
template <typename Work>
Result<void> parallelUntilStopped(std::size_t begin, std::size_t end, std::size_t grain,
                                  const RunContext& context, const Work& work) {
    std::atomic<bool> stop{false};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, grain), [&](const auto& range) {
        Signature scratch;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            if (stop.load(std::memory_order_relaxed)) return;
            if (!context.checkpoint()) {
                stop = true;
                return;
            }
            work(i, scratch);
        }
    });
    return context.checkpoint();
}

class Searcher {
  public:
    Searcher(const Signature& query, const SignatureSet& set, const SearchOptions& options,
             const RunContext& context)
        : query_(query), options_(options), context_(context) {
        if (query.attributes) statistics_ = std::make_unique<const StatisticsBound>(query, options.score);
        result_.counts.candidates = set.size();
        // Spread evenly: shapes that came together are often alike.
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
            auto candidates = boundSlice(begin, end);
            RETURN_IF_ERROR(candidates);
            RETURN_IF_ERROR(visit(*candidates));
            begin = end;
            slice *= kSliceGrowth;
            blocksDone_ = end;
        }
        return std::move(result_);
    }

  private:
    // No candidate below this can be among the hits.
    double needed() const {
        return result_.hits.size() == options_.k ? result_.hits.back().score : options_.threshold;
    }

    // Which rows pass filter and exclusion; empty: all.
    std::vector<std::uint8_t> wantedRows(const SignatureBlock& block) const {
        const bool excludes = options_.excludeId && block.id(0) <= *options_.excludeId &&
                              *options_.excludeId <= block.id(block.size() - 1);
        if (options_.filter.acceptsAll() && !excludes) return {};
        constexpr std::uint8_t kUnknown = 2;
        std::vector<std::uint8_t> passes(block.metadataCount(), kUnknown);
        std::vector<std::uint8_t> wanted(block.size());
        for (std::size_t row = 0; row < block.size(); ++row) {
            std::uint8_t& pass = passes[block.metadataNumber(row)];
            if (pass == kUnknown) pass = options_.filter.matches(block.metadata(row)) ? 1 : 0;
            wanted[row] = excludes && block.id(row) == *options_.excludeId ? 0 : pass;
        }
        return wanted;
    }

    void boundByPoints(const SignatureBlock& block, const std::vector<std::uint8_t>& wanted, double least,
                       Signature& scratch, BlockBounds& bounds) const {
        for (std::uint32_t row = 0; row < block.size(); ++row) {
            if ((!wanted.empty() && wanted[row] == 0) || block.attributed(row)) continue;
            ++bounds.counts.afterFirstHalf;
            ++bounds.counts.afterStatistics;
            block.scored(row, scratch);
            const double bound = scoreUpperBound(query_, scratch, options_.score);
            if (bound >= least) bounds.candidates.push_back({bound, &block, row});
        }
    }

    BlockBounds boundBlock(const SignatureBlock& block, double least, Signature& scratch) const {
        BlockBounds bounds;
        const std::vector<std::uint8_t> wanted = wantedRows(block);
        bounds.filtered = wanted.empty()
                              ? block.size()
                              : static_cast<std::uint64_t>(std::count(wanted.begin(), wanted.end(), 1));
        if (bounds.filtered == 0) return bounds;
        if (statistics_) {
            std::vector<StatisticsBound::Left> left;
            statistics_->scan(block, wanted, least, left, bounds.counts);
            bounds.candidates.reserve(left.size());
            for (const auto& row : left)
                bounds.candidates.push_back({scoreAt(row.distance), &block, row.row});
        }
        if (block.attributedCount() < block.size()) boundByPoints(block, wanted, least, scratch, bounds);
        return bounds;
    }

    Result<std::vector<Candidate>> boundSlice(std::size_t begin, std::size_t end) {
        std::vector<BlockBounds> perBlock(end - begin);
        const double least = needed();
        auto done = parallelUntilStopped(begin, end, 1, context_, [&](std::size_t b, Signature& scratch) {
            perBlock[b - begin] = boundBlock(*order_[b], least, scratch);
        });
        RETURN_IF_ERROR(done);
        std::vector<Candidate> all;
        for (const BlockBounds& block : perBlock) {
            all.insert(all.end(), block.candidates.begin(), block.candidates.end());
            result_.counts.filtered += block.filtered;
            result_.counts.afterFirstHalf += block.counts.afterFirstHalf;
            result_.counts.afterStatistics += block.counts.afterStatistics;
        }
        std::sort(all.begin(), all.end(), visitedBefore);
        return all;
    }

    // Scores candidates by falling bound until no bound reaches the k-th score.
    Result<void> visit(const std::vector<Candidate>& candidates) {
        std::size_t chunk = kFirstChunk;
        for (std::size_t begin = 0; begin < candidates.size();) {
            const double least = needed();
            // A candidate whose bound equals the k-th score may still win by its smaller id.
            std::size_t end = begin;
            while (end < candidates.size() && end - begin < chunk && candidates[end].bound >= least) ++end;
            if (end == begin) break;
            RETURN_IF_ERROR(scoreChunk(candidates, begin, end, least));
            begin = end;
            chunk = std::min(chunk * 2, kLargestChunk);
            context_.report("search", blocksDone_, order_.size());
        }
        return {};
    }

    Result<void> scoreChunk(const std::vector<Candidate>& candidates, std::size_t begin, std::size_t end,
                            double least) {
        constexpr double kRuledOut = -1.0;
        std::vector<double> scores(end - begin, kRuledOut);
        // Signatures of many points take milliseconds each, so a stop is looked for before each.
        auto done =
            parallelUntilStopped(begin, end, kGrain, context_, [&](std::size_t i, Signature& scratch) {
                candidates[i].block->scored(candidates[i].row, scratch);
                if (scratch.attributes && scoreUpperBound(query_, scratch, options_.score) < least) return;
                scores[i - begin] = score(query_, scratch, options_.score);
            });
        if (!done) return done;
        for (std::size_t i = begin; i < end; ++i) {
            if (scores[i - begin] == kRuledOut) continue;
            ++result_.counts.scored;
            if (scores[i - begin] >= options_.threshold)
                result_.hits.push_back({candidates[i].id(), scores[i - begin]});
        }
        std::sort(result_.hits.begin(), result_.hits.end(), ranksBefore);
        if (result_.hits.size() > options_.k) result_.hits.resize(options_.k);
        return {};
    }

    const Signature& query_;
    const SearchOptions& options_;
    const RunContext& context_;
    std::unique_ptr<const StatisticsBound> statistics_;  // null: the query has points alone
    std::vector<const SignatureBlock*> order_;
    std::size_t blocksDone_ = 0;
    SearchResult result_;
};

}  // namespace

Result<SearchResult> topK(const Signature& query, const SignatureSet& set, const SearchOptions& options,
                          const RunContext& context) {
    RETURN_IF_ERROR(check(query, set, options));
    try {
        const auto began = RunContext::Clock::now();
        auto result = Searcher(query, set, options, context).run();
        if (result) result->seconds = std::chrono::duration<double>(RunContext::Clock::now() - began).count();
        return result;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to search " + std::to_string(set.size()) + " signatures");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("search: ") + e.what());
    }
}

Result<std::vector<SearchResult>> topKBatch(const std::vector<BatchQuery>& queries, const SignatureSet& set,
                                            const SearchOptions& options, const RunContext& context) {
    try {
        std::vector<Result<SearchResult>> found(queries.size(), SearchResult{});
        std::atomic<bool> failed{false};
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, queries.size(), 1), [&](const auto& range) {
            // Alone: what a query spreads over threads it would have to wait for.
            tbb::task_arena alone(1);
            for (std::size_t q = range.begin(); q < range.end() && !failed.load(); ++q) {
                SearchOptions own = options;
                own.excludeId = queries[q].excludeId;
                found[q] = alone.execute([&] { return topK(queries[q].signature, set, own, context); });
                if (!found[q]) failed = true;
            }
        });
        std::vector<SearchResult> results;
        results.reserve(queries.size());
        for (std::size_t q = 0; q < found.size(); ++q) {
            if (!found[q]) {
                return fail(found[q].error().code,
                            "query " + std::to_string(q) + ": " + found[q].error().message);
            }
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
