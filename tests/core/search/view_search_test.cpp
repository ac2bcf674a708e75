// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/view_search.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

ViewSignature randomView(Random& random) {
    ViewSignature view;
    for (std::size_t bin = 0; bin < kViewBins; ++bin) {
        view.setLevel(bin, static_cast<std::uint8_t>(random.below(random.below(3) == 0 ? 16 : 4)));
    }
    view.size = static_cast<float>(1.0 + random.uniform());
    return view;
}

// Three thousand shapes with ids 10, 20, ...; every seventh has no views, and every fifth those of another,
// so that distances tie.
struct ViewGallery {
    std::vector<IndexEntry> entries;
    SignatureSet set;
};

const ViewGallery& viewGallery() {
    static const ViewGallery made = [] {
        ViewGallery g;
        Random random(3);
        for (std::int64_t i = 1; i <= 3000; ++i) {
            IndexEntry entry;
            entry.id = 10 * i;
            entry.metadata = {{"odd", i % 2 == 1 ? "yes" : "no"}};
            entry.signature = testing_support::randomSignature(random, 4);
            if (i % 5 == 0) {
                entry.views = g.entries[static_cast<std::size_t>(i) - 4].views;
            } else if (i % 7 != 0) {
                ViewSet views;
                for (ViewSignature& view : views.views) view = randomView(random);
                entry.views = std::make_shared<const ShapeViews>(views);
            }
            g.entries.push_back(std::move(entry));
        }
        g.set = SignatureSet().with(g.entries, {});
        return g;
    }();
    return made;
}

std::vector<ViewHit> bruteForce(const ViewQuery& query, std::size_t count, const Filter& filter,
                                std::optional<std::int64_t> excludeId) {
    std::vector<ViewHit> hits;
    for (const IndexEntry& entry : viewGallery().entries) {
        if (!entry.views || entry.id == excludeId || !filter.matches(entry.metadata)) continue;
        hits.push_back({entry.id, query.distance(entry.views->set)});
    }
    std::stable_sort(hits.begin(), hits.end(),
                     [](const ViewHit& a, const ViewHit& b) { return a.distance < b.distance; });
    hits.resize(std::min(hits.size(), count));
    return hits;
}

void expectSame(const std::vector<ViewHit>& hits, const std::vector<ViewHit>& expected) {
    ASSERT_EQ(hits.size(), expected.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        EXPECT_EQ(hits[i].id, expected[i].id) << i;
        EXPECT_EQ(hits[i].distance, expected[i].distance) << i;
    }
}

TEST(ViewSearch, EqualsBruteForceAtEveryCountFilterAndScale) {
    Random random(11);
    for (const std::size_t count : {1, 7, 64, 5000}) {
        for (const bool keepScale : {false, true}) {
            for (const char* text : {"", "odd=yes"}) {
                const ViewQuery query(randomView(random), {true, keepScale, false});
                const Filter filter = Filter::parse(text).value();
                const auto hits = nearestByViews(query, viewGallery().set, count, filter, 30);
                ASSERT_TRUE(hits) << hits.error().message;
                expectSame(*hits, bruteForce(query, count, filter, 30));
            }
        }
    }
}

TEST(ViewSearch, DoesNotDependOnTheNumberOfThreads) {
    Random random(12);
    const ViewQuery query(randomView(random));
    const auto wide = nearestByViews(query, viewGallery().set, 20, {}, {});
    tbb::task_arena alone(1);
    const auto narrow = alone.execute([&] { return nearestByViews(query, viewGallery().set, 20, {}, {}); });
    expectSame(wide.value(), narrow.value());
}

TEST(ViewSearch, FindsNothingWhereNoShapeHasViews) {
    Random random(13);
    const ViewQuery query(randomView(random));
    IndexEntry bare = viewGallery().entries.front();
    bare.views = nullptr;
    EXPECT_TRUE(nearestByViews(query, SignatureSet().with({bare}, {}), 5, {}, {}).value().empty());
    EXPECT_TRUE(nearestByViews(query, SignatureSet(), 5, {}, {}).value().empty());
    EXPECT_TRUE(nearestByViews(query, viewGallery().set, 0, {}, {}).value().empty());
}

TEST(ViewSearch, SurvivesUpdatesOfTheSet) {
    Random random(14);
    const ViewQuery query(randomView(random));
    IndexEntry changed = viewGallery().entries[100];
    ViewSet same;
    for (ViewSignature& view : same.views) view = randomView(random);
    changed.views = std::make_shared<const ShapeViews>(same);
    const SignatureSet set = viewGallery().set.with({changed}, {20});
    const ViewQuery itself(same.views[3]);
    EXPECT_EQ(nearestByViews(itself, set, 1, {}, {}).value().front().id, changed.id);
    EXPECT_GT(set.memoryBytes(), 3000u * sizeof(ShapeViews) / 2);
    const auto rest = nearestByViews(query, set, 5000, {}, {});
    ASSERT_TRUE(rest);
    for (const ViewHit& hit : *rest) EXPECT_NE(hit.id, 20);
}

TEST(ViewSearch, StopsWhenCancelled) {
    Random random(15);
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto stopped = nearestByViews(ViewQuery(randomView(random)), viewGallery().set, 5, {}, {}, context);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
