// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/duplicate_search.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <unordered_map>
#include <utility>

#include "client/cli/fit_output.h"
#include "core/base/disjoint_sets.h"
#include "core/base/number_text.h"
#include "core/base/return_if_error.h"
#include "core/search/signature_set.h"
#include "core/search/top_k.h"
#include "core/signature/signature_codec.h"

namespace shapedb::cli {

namespace {

/// Queries of one call: a call should take about a second in a large collection.
constexpr std::size_t kBatch = 200;
/// Shapes per request while listing: the server's limit.
constexpr std::uint32_t kPage = 1000;

using Progress = std::function<void(const char* what, std::uint64_t done, std::uint64_t total)>;

PairFit fitOf(const client::Comparison& compared) {
    PairFit fit{compared.score, compared.verdict, std::nullopt, fitsMirrored(compared.fit)};
    if (compared.fit) fit.pose = compared.fit->best;
    return fit;
}

class DuplicateFinder {
  public:
    DuplicateFinder(const client::Client& client, const DuplicateOptions& options, const Progress& progress,
                    const RunContext& context)
        : client_(client), options_(options), progress_(progress), context_(context) {}

    Result<DuplicateReport> run() {
        RETURN_IF_ERROR(list());
        const auto info = client_.serverInfo(context_);
        RETURN_IF_ERROR(info);
        mostHits_ = std::max(1u, info->limits.maxK);
        const std::size_t batch = std::clamp<std::size_t>(info->limits.maxBatch, 1, kBatch);
        for (std::size_t at = 0; at < report_.shapes.size(); at += batch) {
            RETURN_IF_ERROR(search(at, std::min(report_.shapes.size(), at + batch)));
            progress_("search", std::min(report_.shapes.size(), at + batch), report_.shapes.size());
        }
        RETURN_IF_ERROR(scoreCutOff());
        for (const auto& [pair, score] : scores_)
            report_.pairs.push_back({pair.first, pair.second, score, {}});
        scores_.clear();
        if (options_.compare) RETURN_IF_ERROR(compareAll());
        std::sort(report_.pairs.begin(), report_.pairs.end(), [](const auto& one, const auto& other) {
            if (one.score() != other.score()) return one.score() > other.score();
            return std::pair(one.a, one.b) < std::pair(other.a, other.b);
        });
        report_.groups = groupsOf(report_.pairs, report_.shapes.size());
        return std::move(report_);
    }

  private:
    Result<void> list() {
        client::ListRequest request;
        request.collection = options_.collection;
        request.filter = options_.filter;
        request.state = client::ShapeState::kReady;
        request.pageSize = kPage;
        do {
            auto page = client_.listShapes(request, context_);
            RETURN_IF_ERROR(page);
            std::move(page->shapes.begin(), page->shapes.end(), std::back_inserter(report_.shapes));
            request.cursor = page->nextCursor;
            progress_("list", report_.shapes.size(), 0);
        } while (!request.cursor.empty());
        for (std::size_t i = 0; i < report_.shapes.size(); ++i) placeOf_[report_.shapes[i].id] = i;
        return {};
    }

    client::SearchOptions searchOptions() const {
        client::SearchOptions options;
        options.collection = options_.collection;
        options.filter = options_.filter;
        options.threshold = options_.threshold;
        options.k = mostHits_;
        options.reflection = options_.score.reflection;
        options.keepScale = options_.score.keepScale;
        options.freeScale = options_.score.freeScale;
        options.atLeast = options_.cluster.atLeast;
        options.allowPartial = options_.cluster.allowPartial;
        options.explanation = false;
        options.verify = false;
        return options;
    }

    /// The shapes [begin, end) as queries.
    Result<void> search(std::size_t begin, std::size_t end) {
        std::vector<client::BatchQuery> queries;
        for (std::size_t i = begin; i < end; ++i) queries.push_back({report_.shapes[i].key, {}});
        const auto replies = client_.searchBatch(searchOptions(), queries, context_);
        if (!replies) {
            const ErrorCode code = replies.error().code;
            // One shape is gone, or the answer would be too large.
            const bool gone = code == ErrorCode::kNotFound || code == ErrorCode::kNotReady;
            if (end - begin == 1) return gone ? Result<void>() : Result<void>(fail(replies.error()));
            if (!gone && code != ErrorCode::kInvalidArgument) return fail(replies.error());
            const std::size_t middle = begin + (end - begin) / 2;
            RETURN_IF_ERROR(search(begin, middle));
            return search(middle, end);
        }
        for (std::size_t i = begin; i < end && i - begin < replies->size(); ++i) {
            const client::SearchReply& reply = (*replies)[i - begin];
            report_.covered = std::min(report_.covered, reply.covered);
            for (const client::Hit& hit : reply.hits) {
                const auto other = placeOf_.find(hit.shape.id);
                if (other != placeOf_.end()) keep(i, other->second, hit.score);
            }
            if (reply.hits.size() >= mostHits_) cutOff_.push_back(i);
        }
        return {};
    }

    void keep(std::size_t a, std::size_t b, double score) {
        if (a != b) scores_[std::minmax(a, b)] = score;
    }

    /// A pair is missing only if both had too many partners for an answer.
    Result<void> scoreCutOff() {
        if (cutOff_.size() < 2) return {};
        const auto collection = client_.getCollection(options_.collection, context_);
        RETURN_IF_ERROR(collection);
        std::vector<IndexEntry> entries;
        for (const std::size_t i : cutOff_) {
            const auto found = client_.getSignature({options_.collection, report_.shapes[i].key}, context_);
            if (!found &&
                (found.error().code == ErrorCode::kNotFound || found.error().code == ErrorCode::kNotReady))
                continue;
            RETURN_IF_ERROR(found);
            auto signature = decodeSignature(found->encoded);
            RETURN_IF_ERROR(signature);
            IndexEntry entry;
            entry.id = static_cast<std::int64_t>(i) + 1;
            entry.signature = std::move(*signature);
            entries.push_back(std::move(entry));
            progress_("fetch", entries.size(), cutOff_.size());
        }
        const SignatureSet set = SignatureSet().with(entries, {});
        SearchOptions options;
        options.k = entries.size();
        options.threshold = options_.threshold;
        options.score.reflection = options_.score.reflection;
        const bool unit = collection->parameters.unit.value_or(LengthUnit::kNone) != LengthUnit::kNone;
        options.score.keepScale = options_.score.keepScale || (unit && !options_.score.freeScale);
        for (const IndexEntry& entry : entries) {
            const auto found = topK(entry.signature, set, options, context_);
            RETURN_IF_ERROR(found);
            for (const SearchHit& hit : found->hits) {
                keep(static_cast<std::size_t>(entry.id - 1), static_cast<std::size_t>(hit.id - 1), hit.score);
            }
        }
        return {};
    }

    Result<void> compareAll() {
        std::vector<DuplicatePair>& pairs = report_.pairs;
        std::vector<char> gone(pairs.size(), 0);
        std::atomic<std::size_t> next{0};
        std::atomic<std::size_t> done{0};
        std::mutex mutex;
        std::optional<Error> error;  // guarded by mutex
        const auto work = [&] {
            for (std::size_t i = next++; i < pairs.size(); i = next++) {
                const auto ref = [&](std::size_t shape) {
                    return client::ShapeRef{options_.collection, report_.shapes[shape].key};
                };
                auto compared = client_.compare(ref(pairs[i].a), ref(pairs[i].b), options_.score, context_);
                if (compared) {
                    pairs[i].fit = fitOf(*compared);
                } else if (compared.error().code == ErrorCode::kNotFound) {
                    gone[i] = 1;
                } else {
                    const std::lock_guard<std::mutex> lock(mutex);
                    if (!error) error = compared.error();
                    next = pairs.size();
                }
                progress_("compare", ++done, pairs.size());
            }
        };
        std::vector<std::thread> workers;
        for (std::size_t i = 1; i < std::min<std::size_t>(options_.jobs, pairs.size()); ++i) {
            workers.emplace_back(work);
        }
        work();
        for (std::thread& worker : workers) worker.join();
        if (error) return fail(*error);
        std::size_t kept = 0;
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            if (gone[i] != 0) continue;
            if (kept != i) pairs[kept] = std::move(pairs[i]);
            ++kept;
        }
        pairs.resize(kept);
        return {};
    }

    const client::Client& client_;
    const DuplicateOptions& options_;
    const Progress& progress_;
    const RunContext& context_;
    std::uint32_t mostHits_ = 1;
    DuplicateReport report_;
    std::unordered_map<std::int64_t, std::size_t> placeOf_;  // by id
    std::map<std::pair<std::size_t, std::size_t>, double> scores_;
    std::vector<std::size_t> cutOff_;  // shapes with as many hits as an answer may have
};

}  // namespace

std::vector<std::vector<std::size_t>> groupsOf(const std::vector<DuplicatePair>& pairs, std::size_t count) {
    DisjointSets sets(count);
    std::set<std::size_t> members;
    for (const DuplicatePair& pair : pairs) {
        sets.unite(static_cast<std::uint32_t>(pair.a), static_cast<std::uint32_t>(pair.b));
        members.insert({pair.a, pair.b});
    }
    std::map<std::uint32_t, std::vector<std::size_t>> groups;  // by the smallest member
    for (const std::size_t member : members) {
        groups[sets.find(static_cast<std::uint32_t>(member))].push_back(member);
    }
    std::vector<std::vector<std::size_t>> list;
    for (auto& [first, group] : groups) list.push_back(std::move(group));
    return list;
}

std::vector<DuplicateLink> linksOf(const std::vector<std::size_t>& group,
                                   const std::vector<const DuplicatePair*>& pairs) {
    std::vector<DuplicateLink> links;
    if (group.empty()) return links;
    links.push_back({group.front(), nullptr});
    std::set<std::size_t> listed = {group.front()};
    // The place of each pair in `pairs` is its rank: the least that leads out of the list comes next.
    std::map<std::size_t, std::vector<std::size_t>> ranksOf;
    for (std::size_t rank = 0; rank < pairs.size(); ++rank) {
        ranksOf[pairs[rank]->a].push_back(rank);
        ranksOf[pairs[rank]->b].push_back(rank);
    }
    const auto& first = ranksOf[group.front()];
    std::set<std::size_t> leading(first.begin(), first.end());
    while (!leading.empty()) {
        const DuplicatePair* pair = pairs[*leading.begin()];
        leading.erase(leading.begin());
        const std::size_t next = listed.count(pair->a) > 0 ? pair->b : pair->a;
        if (!listed.insert(next).second) continue;
        links.push_back({next, pair});
        leading.insert(ranksOf[next].begin(), ranksOf[next].end());
    }
    return links;
}

Result<DuplicateReport> findDuplicates(const client::Client& client, const DuplicateOptions& options,
                                       const Progress& progress, const RunContext& context) {
    if (!(options.threshold > 0.0 && options.threshold <= 1.0)) {
        return fail(ErrorCode::kInvalidArgument,
                    "--threshold is " + numberText(options.threshold) + "; it must be above 0, at most 1");
    }
    return DuplicateFinder(client, options, progress, context).run();
}

}  // namespace shapedb::cli
