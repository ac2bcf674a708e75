// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/top_k.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "core/matching/score.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::disturbed;
using testing_support::randomSignature;
using testing_support::sameBits;

IndexEntry entryOf(std::int64_t id, Signature signature) {
    IndexEntry entry;
    entry.id = id;
    entry.key = "k" + std::to_string(id);
    entry.metadata["third"] = std::to_string(id % 3);
    if (id % 5 == 0) entry.metadata["fifth"] = "yes";
    entry.signature = std::move(signature);
    return entry;
}

// A set and its full entries, which the plain reference scores.
struct Library {
    std::vector<IndexEntry> entries;
    SignatureSet set;

    explicit Library(std::vector<IndexEntry> all)
        : entries(std::move(all)), set(SignatureSet().with(entries, {})) {}
};

// Random shapes, near copies of the query, and the same signature under several ids.
Library randomLibrary(Random& random, const Signature& query, std::size_t count) {
    std::vector<IndexEntry> entries;
    std::vector<Signature> before = {query};
    for (std::size_t i = 0; i < count; ++i) {
        Signature signature;
        switch (random.below(4)) {
            case 0: signature = before[random.below(before.size())]; break;
            case 1: signature = disturbed(query, random, random.uniform(0, 0.1)); break;
            default: signature = randomSignature(random, 6);
        }
        before.push_back(signature);
        entries.push_back(entryOf(static_cast<std::int64_t>(7 * i + 1 + random.below(7)), signature));
    }
    return Library(std::move(entries));
}

// Scores everything and sorts.
std::vector<SearchHit> bruteForce(const Signature& query, const Library& library,
                                  const SearchOptions& options) {
    std::vector<SearchHit> hits;
    for (const IndexEntry& entry : library.entries) {
        if (options.excludeId && *options.excludeId == entry.id) continue;
        if (!options.filter.matches(entry.metadata, entry.key)) continue;
        const double value = score(query, entry.signature, options.score);
        if (value >= options.threshold) hits.push_back({entry.id, value});
    }
    std::stable_sort(hits.begin(), hits.end(), [](const SearchHit& a, const SearchHit& b) {
        return a.score > b.score || (a.score == b.score && a.id < b.id);
    });
    if (hits.size() > options.k) hits.resize(options.k);
    return hits;
}

void expectSameHits(const std::vector<SearchHit>& hits, const std::vector<SearchHit>& expected) {
    ASSERT_EQ(hits.size(), expected.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        ASSERT_EQ(hits[i].id, expected[i].id) << "rank " << i;
        ASSERT_TRUE(sameBits(hits[i].score, expected[i].score)) << "rank " << i;
    }
}

SearchOptions randomOptions(Random& random, const Library& library) {
    SearchOptions options;
    const std::vector<std::size_t> ks = {
        1, 2, 3, 10, 31, 32, 33, library.entries.size(), library.entries.size() + 1};
    options.k = std::max<std::size_t>(1, ks[random.below(ks.size())]);
    const std::vector<double> thresholds = {0.0, 0.0, 0.0, 0.3, 0.9, 1.0, random.uniform()};
    options.threshold = thresholds[random.below(thresholds.size())];
    const std::vector<const char*> filters = {
        "", "", "third=1", "fifth", "!fifth, third!=0", "none", "@key^=k1", "@key=k12 | fifth"};
    options.filter = Filter::parse(filters[random.below(filters.size())]).value();
    options.score.reflection = random.below(2) == 0;
    options.score.keepScale = random.below(4) == 0;
    if (random.below(3) == 0) options.score.kernelWidth = random.uniform(0.01, 0.5);
    if (random.below(3) == 0 && !library.entries.empty()) {
        options.excludeId = library.entries[random.below(library.entries.size())].id;
    }
    return options;
}

// The hits of brute force, and consistent counts.
void expectExact(const Signature& query, const Library& library, const SearchOptions& options) {
    const auto result = topK(query, library.set, options);
    ASSERT_TRUE(result) << result.error().message;
    expectSameHits(result->hits, bruteForce(query, library, options));
    std::uint64_t passing = 0;
    for (const IndexEntry& entry : library.entries) {
        const bool excluded = options.excludeId && *options.excludeId == entry.id;
        passing += !excluded && options.filter.matches(entry.metadata, entry.key) ? 1u : 0u;
    }
    const SearchCounts& counts = result->counts;
    EXPECT_EQ(counts.candidates, library.entries.size());
    EXPECT_EQ(counts.filtered, passing);
    EXPECT_LE(counts.scans.left[0], passing);
    EXPECT_LE(counts.scans.left[1], counts.scans.left[0]);
    EXPECT_LE(counts.scored, counts.scans.left[1]);
    EXPECT_GE(counts.scored, result->hits.size());
}

TEST(TopK, EqualsBruteForceBitForBit) {
    Random random(1);
    for (int round = 0; round < 300; ++round) {
        const Signature query = randomSignature(random, 7);
        const Library library = randomLibrary(random, query, random.below(round % 20 == 0 ? 9000 : 150));
        const SearchOptions options = randomOptions(random, library);
        expectExact(query, library, options);
        if (HasFatalFailure()) FAIL() << "round " << round << " k " << options.k;
    }
}

// With attributes, as the default profile makes them; some without among them, some twice.
TEST(TopK, EqualsBruteForceOnScansBitForBit) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    Random random(10);
    std::vector<IndexEntry> entries;
    std::int64_t id = 1;
    for (const auto& scan : scans) {
        entries.push_back(entryOf(id++, scan.signature));
        for (int copy = 0; copy < 5; ++copy) {
            entries.push_back(entryOf(
                id++, testing_support::disturbedAttributed(scan.signature, random, random.uniform(0, 0.05))));
        }
        entries.push_back(entryOf(id++, scan.signature));
        Signature plain = scan.signature;
        plain.attributes.reset();
        entries.push_back(entryOf(id++, plain));
    }
    const Library library(std::move(entries));
    for (int round = 0; round < 36; ++round) {
        SearchOptions options = randomOptions(random, library);
        options.score.partial = round % 4 == 0;
        Signature query = scans[random.below(scans.size())].signature;
        if (round % 3 == 0) query = testing_support::disturbedAttributed(query, random, 0.02);
        expectExact(query, library, options);
        if (HasFatalFailure()) FAIL() << "round " << round << " k " << options.k;
    }
}

// Several slices, each ruled out by the best scores of those before.
TEST(TopK, EqualsBruteForceOnManyBlocksBitForBit) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    Random random(12);
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 9000; ++id) {
        const Signature& base = scans[random.below(scans.size())].signature;
        entries.push_back(
            entryOf(id, testing_support::disturbedAttributed(base, random, random.uniform(0, 0.1))));
        entries.back().signature.scale = std::exp(random.normal());
    }
    const Library library(std::move(entries));
    for (int round = 0; round < 24; ++round) {
        SearchOptions options = randomOptions(random, library);
        options.k = std::min<std::size_t>(options.k, 40);
        options.score.partial = round % 6 == 5;
        expectExact(library.entries[random.below(library.entries.size())].signature, library, options);
        if (HasFatalFailure()) FAIL() << "round " << round << " k " << options.k;
    }
}

TEST(TopK, BatchEqualsEachQueryAlone) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    Random random(13);
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 2500; ++id) {
        const Signature& base = scans[random.below(scans.size())].signature;
        entries.push_back(entryOf(id, testing_support::disturbedAttributed(base, random, 0.05)));
    }
    const Library library(std::move(entries));
    std::vector<BatchQuery> queries;
    for (std::size_t q = 0; q < 23; ++q) {
        const IndexEntry& entry = library.entries[random.below(library.entries.size())];
        queries.push_back(
            {entry.signature, q % 2 == 0 ? std::optional<std::int64_t>(entry.id) : std::nullopt});
    }
    SearchOptions options;
    options.filter = Filter::parse("third=1").value();
    const auto together = topKBatch(queries, library.set, options);
    ASSERT_TRUE(together) << together.error().message;
    ASSERT_EQ(together->size(), queries.size());
    for (std::size_t q = 0; q < queries.size(); ++q) {
        options.excludeId = queries[q].excludeId;
        expectSameHits((*together)[q].hits, bruteForce(queries[q].signature, library, options));
    }
    EXPECT_TRUE(topKBatch({}, library.set, options)->empty());
}

TEST(TopK, BatchErrorNamesTheQuery) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    const Library library({entryOf(1, scans[0].signature)});
    BatchQuery good{scans[0].signature, std::nullopt};
    BatchQuery bad = good;
    bad.signature.attributes.reset();
    const auto result = topKBatch({good, bad}, library.set, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message.rfind("query 1: ", 0), 0u) << result.error().message;
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(topKBatch({good}, library.set, {}, context).error().code, ErrorCode::kCancelled);
}

// A search cannot compare what a signature does not have.
TEST(TopK, RefusesAQueryWithoutAttributesWhereShapesHaveThem) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    const Library library({entryOf(1, scans[0].signature)});
    Signature query = scans[0].signature;
    query.attributes.reset();
    const auto result = topK(query, library.set, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(result.error().message.find("attributes"), std::string::npos) << result.error().message;
}

TEST(TopK, RulesOutMostScansWithoutAligning) {
    const auto& scans = testing_support::scannedFamilies(1, 1);
    Random random(11);
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 1300; ++id) {
        const auto& scan = scans[static_cast<std::size_t>(id) % scans.size()];
        entries.push_back(entryOf(id, testing_support::disturbedAttributed(scan.signature, random, 0.02)));
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    SearchOptions options;
    options.k = 10;
    std::uint64_t scored = 0;
    for (const auto& scan : scans) {
        const auto result = topK(scan.signature, set, options);
        ASSERT_TRUE(result);
        scored += result->counts.scored;
    }
    EXPECT_LT(scored / scans.size(), set.size() / 4);
}

TEST(TopK, BreaksTiesByIdAtEveryK) {
    Random random(2);
    const Signature query = randomSignature(random, testing_support::Kind::kPlain, 7);
    const Signature other = disturbed(query, random, 0.05);
    std::vector<IndexEntry> entries;
    // More ties than a chunk, the copies of the query under the highest ids.
    for (std::int64_t id = 1; id <= 300; ++id) entries.push_back(entryOf(id, id > 200 ? query : other));
    const SignatureSet set = SignatureSet().with(entries, {});
    for (std::size_t k = 1; k <= 301; k += k < 40 || k > 95 ? 1 : 5) {
        SearchOptions options;
        options.k = k;
        const auto result = topK(query, set, options);
        ASSERT_TRUE(result);
        ASSERT_EQ(result->hits.size(), std::min<std::size_t>(k, 300));
        for (std::size_t i = 0; i < result->hits.size(); ++i) {
            ASSERT_EQ(result->hits[i].id, static_cast<std::int64_t>(i < 100 ? 201 + i : i - 99));
            ASSERT_EQ(result->hits[i].score == 1.0, i < 100);
        }
    }
}

TEST(TopK, IsTheSameOnAnyNumberOfThreads) {
    Random random(3);
    for (int round = 0; round < 15; ++round) {
        const Signature query = randomSignature(random, 7);
        const Library library = randomLibrary(random, query, 3000);
        const SignatureSet& set = library.set;
        const SearchOptions options = randomOptions(random, library);
        const auto expected = topK(query, set, options);
        ASSERT_TRUE(expected);
        for (const int threads : {1, 2, 3, 8}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));
            tbb::task_arena arena(threads);
            const auto result = arena.execute([&] { return topK(query, set, options); });
            ASSERT_TRUE(result);
            expectSameHits(result->hits, expected->hits);
        }
    }
}

TEST(TopK, RulesOutMostShapesWithoutScoring) {
    Random random(4);
    const Signature query = randomSignature(random, testing_support::Kind::kPlain, 7);
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 5000; ++id) {
        entries.push_back(entryOf(id, id == 4321
                                          ? disturbed(query, random, 0.01)
                                          : randomSignature(random, testing_support::Kind::kPlain, 7)));
    }
    SearchOptions options;
    options.k = 1;
    const auto result = topK(query, SignatureSet().with(entries, {}), options);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->hits.front().id, 4321);
    EXPECT_LT(result->counts.scored, 500u);
}

TEST(TopK, FindsNothingInAnEmptySet) {
    Random random(5);
    const auto result = topK(randomSignature(random), SignatureSet(), {});
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->hits.empty());
    EXPECT_EQ(result->counts.candidates, 0u);
    EXPECT_EQ(result->counts.filtered, 0u);
    EXPECT_EQ(result->counts.scored, 0u);
}

TEST(TopK, RefusesOptionsOutOfRange) {
    Random random(6);
    const Signature query = randomSignature(random);
    const Library library = randomLibrary(random, query, 10);
    const SignatureSet& set = library.set;
    const auto refused = [&](const SearchOptions& options, const char* word) {
        const auto result = topK(query, set, options);
        ASSERT_FALSE(result) << word;
        EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
    };
    SearchOptions options;
    options.k = 0;
    refused(options, "k is 0");
    for (const double threshold :
         {-0.001, 1.001, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        options = {};
        options.threshold = threshold;
        refused(options, "threshold");
    }
    options = {};
    options.score.kernelWidth = 0.0;
    refused(options, "kernel_width");
    options = {};
    options.k = std::numeric_limits<std::size_t>::max();
    EXPECT_EQ(topK(query, set, options)->hits.size(), 10u);
}

TEST(TopK, StopsWhenCancelledOrLate) {
    Random random(7);
    const Signature query = randomSignature(random, testing_support::Kind::kPlain, 7);
    const Library library = randomLibrary(random, query, 2000);
    const SignatureSet& set = library.set;
    SearchOptions options;
    options.k = 2000;

    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    for (const SignatureSet& any : {set, SignatureSet()}) {
        const auto result = topK(query, any, options, context);
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
    }

    // In the middle: at the first report.
    cancel = false;
    int reports = 0;
    context.progress = [&](const char*, std::uint64_t done, std::uint64_t total) {
        EXPECT_LE(done, total);
        ++reports;
        cancel = true;
    };
    const auto stopped = topK(query, set, options, context);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
    EXPECT_EQ(reports, 1);

    RunContext late;
    late.deadline = RunContext::Clock::now() - std::chrono::seconds(1);
    const auto result = topK(query, set, options, late);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kDeadlineExceeded);
}

// Signatures of many points take long each: a stop must not wait for the end of the chunk.
TEST(TopK, StopsInTheMiddleOfAChunk) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    Random random(8);
    const auto heavy = [&] {
        Signature s = randomSignature(random, testing_support::Kind::kEqualWeight, 12);
        while (s.points.size() < 12) {
            s = randomSignature(random, testing_support::Kind::kEqualWeight, 12);
        }
        return s;
    };
    const Signature query = heavy();
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 64; ++id) entries.push_back(entryOf(id, heavy()));
    const SignatureSet set = SignatureSet().with(entries, {});
    SearchOptions options;
    options.k = 64;

    // How long the first chunk takes: progress is reported when it is done.
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    auto begin = RunContext::Clock::now();
    auto chunk = RunContext::Clock::duration::zero();
    context.progress = [&](const char*, std::uint64_t, std::uint64_t) {
        chunk = RunContext::Clock::now() - begin;
        cancel = true;
    };
    ASSERT_FALSE(topK(query, set, options, context));
    ASSERT_GT(chunk, RunContext::Clock::duration::zero());

    // Stopped after a tenth of that. The best of some attempts: the machine may be busy.
    auto stopped = RunContext::Clock::duration::max();
    for (int attempt = 0; attempt < 5; ++attempt) {
        RunContext late;
        begin = RunContext::Clock::now();
        late.deadline = begin + chunk / 10;
        const auto result = topK(query, set, options, late);
        stopped = std::min(stopped, RunContext::Clock::now() - begin);
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::kDeadlineExceeded);
    }
    EXPECT_LT(stopped, chunk * 6 / 10);
}

TEST(TopK, ReportsAnExceptionOfTheCallerAsAnError) {
    Random random(9);
    const Signature query = randomSignature(random);
    RunContext context;
    context.progress = [](const char*, std::uint64_t, std::uint64_t) { throw std::runtime_error("no room"); };
    const auto result = topK(query, randomLibrary(random, query, 10).set, {}, context);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kInternal);
    EXPECT_NE(result.error().message.find("no room"), std::string::npos);
}

}  // namespace
}  // namespace shapedb
