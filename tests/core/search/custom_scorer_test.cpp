// SPDX-License-Identifier: GPL-3.0-or-later
// The search is independent of the method: any scorer can be plugged in.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/search/top_k.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

// Compares nothing but the number of points and the scale.
class SizeScorer final : public Scorer {
  public:
    explicit SizeScorer(const Signature& query) : query_(query) {}

    bool compares(const ShapeRow& shape) const override { return shape.pointCount > 0; }
    double score(const ShapeRow& shape) const override {
        const double points = static_cast<double>(shape.pointCount) / kMaxSignaturePoints;
        return std::exp(-std::abs(std::log(shape.scale / query_.row().scale))) * (1.0 - 0.5 * points);
    }
    double bound(const ShapeRow& shape) const override {
        return std::exp(-std::abs(std::log(shape.scale / query_.row().scale)));
    }
    Explanation explain(const ShapeRow& shape) const override {
        Explanation explanation;
        explanation.score = score(shape);
        return explanation;
    }

  private:
    PackedShape query_;
};

// Scores from what its scan handed on alone.
class HandingOnScorer final : public Scorer {
  public:
    bool compares(const ShapeRow&) const override { return true; }
    double score(const ShapeRow& shape) const override { return 1.0 / (1.0 + std::floor(shape.scale)); }
    double bound(const ShapeRow&) const override { return 1.0; }
    Explanation explain(const ShapeRow&) const override { return {}; }
    void scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double,
              std::vector<Survivor>& left, ScanCounts&) const override {
        for (std::uint32_t row = 0; row < rows.count; ++row) {
            if (wanted.empty() || wanted[row] != 0) left.push_back({1.0, row, Findings(rows.scales[row])});
        }
    }
    std::optional<double> scoreIfReaches(const ShapeRow&, const Survivor& survivor,
                                         double least) const override {
        const double value = 1.0 / (1.0 + std::floor(survivor.findings.as<double>()));
        if (value < least) return std::nullopt;
        return value;
    }
};

// Scans take a while, so that searches wait for one another's threads. Counts the scans that were done by a
// thread which called for another search.
class SlowScorer final : public Scorer {
  public:
    static thread_local const SlowScorer* wanted;  ///< by the search that this thread called for; may be null
    static std::atomic<int> foreign;

    bool compares(const ShapeRow&) const override { return true; }
    double score(const ShapeRow&) const override { return 1.0; }
    double bound(const ShapeRow&) const override { return 1.0; }
    Explanation explain(const ShapeRow&) const override { return {}; }
    void scan(const ShapeRows&, const std::vector<std::uint8_t>&, double, std::vector<Survivor>&,
              ScanCounts&) const override {
        if (wanted != nullptr && wanted != this) ++foreign;
        std::this_thread::sleep_for(std::chrono::milliseconds(1 + calls_++ % 3));
    }

  private:
    mutable std::atomic<int> calls_{0};
};

thread_local const SlowScorer* SlowScorer::wanted = nullptr;
std::atomic<int> SlowScorer::foreign{0};

std::vector<IndexEntry> randomEntries(Random& random, std::int64_t count) {
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= count; ++id) {
        entries.push_back({id, {}, testing_support::randomSignature(random, 8)});
        entries.back().signature.scale = 10.0 * std::exp(random.normal());
    }
    return entries;
}

std::vector<SearchHit> bruteForce(const Scorer& scorer, const std::vector<IndexEntry>& entries,
                                  std::size_t k) {
    std::vector<SearchHit> hits;
    for (const IndexEntry& entry : entries) {
        const PackedShape shape(entry.signature);
        hits.push_back({entry.id, scorer.score(shape.row())});
    }
    std::sort(hits.begin(), hits.end(), [](const SearchHit& a, const SearchHit& b) {
        return a.score != b.score ? a.score > b.score : a.id < b.id;
    });
    hits.resize(std::min(k, hits.size()));
    return hits;
}

void expectExact(const Scorer& scorer, const std::vector<IndexEntry>& entries, std::size_t k) {
    SearchOptions options;
    options.k = k;
    const auto found = topK(scorer, SignatureSet().with(entries, {}), options);
    ASSERT_TRUE(found) << found.error().message;
    const std::vector<SearchHit> expected = bruteForce(scorer, entries, k);
    ASSERT_EQ(found->hits.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(found->hits[i].id, expected[i].id);
        EXPECT_EQ(found->hits[i].score, expected[i].score);
    }
    EXPECT_LE(found->counts.scored, found->counts.filtered);
}

TEST(CustomScorer, SearchIsExactWithItsDefaultScan) {
    Random random(1);
    const std::vector<IndexEntry> entries = randomEntries(random, 3000);
    for (const std::size_t k : {1, 10, 500, 4000}) {
        expectExact(SizeScorer(testing_support::randomSignature(random, 8)), entries, k);
    }
}

TEST(CustomScorer, SearchHandsBackWhatItsScanFound) {
    Random random(2);
    const std::vector<IndexEntry> entries = randomEntries(random, 3000);
    for (const std::size_t k : {1, 10, 500, 4000}) expectExact(HandingOnScorer(), entries, k);
}

TEST(CustomScorer, BoundsRuleOutMostShapes) {
    Random random(3);
    const std::vector<IndexEntry> entries = randomEntries(random, 5000);
    SearchOptions options;
    options.k = 1;
    const SizeScorer scorer(testing_support::randomSignature(random, 8));
    const auto found = topK(scorer, SignatureSet().with(entries, {}), options);
    ASSERT_TRUE(found);
    EXPECT_LT(found->counts.scored, 4500u);
    options.k = 0;
    EXPECT_EQ(topK(scorer, SignatureSet(), options).error().code, ErrorCode::kInvalidArgument);
}

TEST(CustomScorer, ASearchDoesNotWaitForPartsOfOthers) {
    Random random(4);
    std::vector<std::shared_ptr<const SignatureBlock>> blocks;
    for (const IndexEntry& entry : randomEntries(random, 12)) {
        auto block = std::make_shared<SignatureBlock>();
        block->append(entry);
        blocks.push_back(std::move(block));
    }
    const SignatureSet set = SignatureSet::ofBlocks(blocks);
    // As in a server: the calls of several threads share an arena.
    tbb::task_arena arena(4, 3);
    std::vector<std::thread> callers;
    for (int t = 0; t < 3; ++t) {
        callers.emplace_back([&] {
            for (int i = 0; i < 10; ++i) {
                const SlowScorer scorer;
                SlowScorer::wanted = &scorer;
                SearchOptions options;
                options.k = 1;
                EXPECT_TRUE(arena.execute([&] { return topK(scorer, set, options); }));
                SlowScorer::wanted = nullptr;
            }
        });
    }
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(SlowScorer::foreign, 0);
}

}  // namespace
}  // namespace shapedb
