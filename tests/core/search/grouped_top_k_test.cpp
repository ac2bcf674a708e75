// SPDX-License-Identifier: GPL-3.0-or-later
// The best groups of a search against a plain reference: score everything, sort, and take hit after hit.
#include <algorithm>
#include <atomic>
#include <map>
#include <optional>

#include <gtest/gtest.h>

#include "core/search/top_k.h"
#include "core/search/verify.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

// The score is the scale, which a test chooses; the bound is loose.
class ScaleScorer final : public Scorer {
  public:
    bool compares(const ShapeRow&) const override { return true; }
    double score(const ShapeRow& shape) const override { return shape.scale; }
    double bound(const ShapeRow& shape) const override { return std::min(1.0, shape.scale + 0.2); }
    Explanation explain(const ShapeRow&) const override { return {}; }
    std::optional<double> scoreIfReaches(const ShapeRow& shape, const Survivor&,
                                         double least) const override {
        ++scored;
        return shape.scale < least ? std::nullopt : std::optional<double>(shape.scale);
    }

    mutable std::atomic<std::uint64_t> scored{0};
};

struct GroupedLibrary {
    std::vector<IndexEntry> entries;
    SignatureSet set;
};

// `values` labels; one shape in eight has none. Scores are of few values, so that ties are frequent.
GroupedLibrary groupedLibrary(Random& random, std::int64_t count, std::uint64_t values) {
    GroupedLibrary library;
    for (std::int64_t id = 1; id <= count; ++id) {
        IndexEntry entry;
        entry.id = id;
        entry.signature = testing_support::randomSignature(random, 2);
        entry.signature.scale = static_cast<double>(1 + random.below(40)) / 40.0;
        if (random.below(8) > 0) entry.metadata["label"] = "l" + std::to_string(random.below(values));
        if (random.below(2) == 0) entry.metadata["half"] = "yes";
        library.entries.push_back(entry);
    }
    library.set = SignatureSet().with(library.entries, {});
    return library;
}

std::vector<SearchHit> plainGroups(const GroupedLibrary& library, const SearchOptions& options) {
    std::vector<const IndexEntry*> ranked;
    for (const IndexEntry& entry : library.entries) {
        if (entry.id == options.excludeId || !options.filter.matches(entry.metadata)) continue;
        if (entry.signature.scale >= options.threshold) ranked.push_back(&entry);
    }
    std::stable_sort(ranked.begin(), ranked.end(), [](const IndexEntry* a, const IndexEntry* b) {
        return a->signature.scale > b->signature.scale;
    });
    std::vector<std::optional<std::string>> order;
    std::map<std::optional<std::string>, std::vector<SearchHit>> groups;
    for (const IndexEntry* entry : ranked) {
        std::optional<std::string> value;
        if (entry->metadata.count("label") > 0) value = entry->metadata.at("label");
        if (groups.count(value) == 0) {
            if (order.size() == options.k) continue;
            order.push_back(value);
        }
        auto& hits = groups[value];
        if (hits.size() < options.grouping->perGroup) hits.push_back({entry->id, entry->signature.scale});
    }
    std::vector<SearchHit> hits;
    for (const auto& value : order) {
        hits.insert(hits.end(), groups[value].begin(), groups[value].end());
    }
    return hits;
}

void expectSameGroupedHits(const std::vector<SearchHit>& found, const std::vector<SearchHit>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(found[i].id, expected[i].id) << i;
        EXPECT_EQ(found[i].score, expected[i].score) << i;
    }
}

TEST(GroupedTopK, FindsTheGroupsOfAPlainRanking) {
    const ScaleScorer scorer;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        Random random(seed);
        // Also more than one block, and more than one slice of blocks.
        const std::int64_t count = seed <= 10 ? static_cast<std::int64_t>(1 + random.below(400)) : 9000;
        const GroupedLibrary library = groupedLibrary(random, count, 1 + random.below(60));
        for (const std::size_t k : {1u, 3u, 20u, 1000u}) {
            for (const std::size_t perGroup : {1u, 2u, 7u}) {
                SearchOptions options;
                options.k = k;
                options.grouping = Grouping{"label", perGroup};
                if (random.below(2) == 0) options.filter = Filter::parse("half").value();
                if (random.below(2) == 0) options.threshold = 0.5;
                if (random.below(2) == 0)
                    options.excludeId = static_cast<std::int64_t>(1 + random.below(400));
                SCOPED_TRACE("seed " + std::to_string(seed) + " k " + std::to_string(k) + " of each " +
                             std::to_string(perGroup));
                const auto found = topK(scorer, library.set, options);
                ASSERT_TRUE(found) << found.error().message;
                expectSameGroupedHits(found->hits, plainGroups(library, options));
            }
        }
    }
}

// What a cut of the k best would miss: one group has all of them.
TEST(GroupedTopK, AGroupOfManyDoesNotHideTheOthers) {
    Random random(1);
    GroupedLibrary library;
    for (std::int64_t id = 1; id <= 3000; ++id) {
        IndexEntry entry;
        entry.id = id;
        entry.signature = testing_support::randomSignature(random, 2);
        const bool mug = id > 10;
        entry.signature.scale = mug ? 0.5 + 0.4 * random.uniform() : 0.01 * static_cast<double>(id);
        entry.metadata["label"] = mug ? "mug" : "other" + std::to_string(id);
        library.entries.push_back(entry);
    }
    library.set = SignatureSet().with(library.entries, {});
    const ScaleScorer scorer;
    SearchOptions options;
    options.k = 5;
    options.grouping = Grouping{"label", 1};
    const auto found = topK(scorer, library.set, options);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->hits.size(), 5u);
    for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(found->hits[i].id, 11 - static_cast<std::int64_t>(i));
    EXPECT_LT(scorer.scored, 2500u) << "most of the mugs cannot be the best one";
}

TEST(GroupedTopK, RefusesGroupsOfNoHits) {
    SearchOptions options;
    options.grouping = Grouping{"label", 0};
    EXPECT_EQ(topK(ScaleScorer(), {}, options).error().code, ErrorCode::kInvalidArgument);
}

TEST(GroupedTopK, IsCancelled) {
    Random random(3);
    const GroupedLibrary library = groupedLibrary(random, 100, 5);
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    SearchOptions options;
    options.grouping = Grouping{"label", 3};
    EXPECT_EQ(topK(ScaleScorer(), library.set, options, context).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
