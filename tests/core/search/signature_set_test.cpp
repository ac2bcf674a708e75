#include "core/search/signature_set.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

using EntryPtr = SignatureSet::EntryPtr;
using Model = std::map<std::int64_t, EntryPtr>;

EntryPtr entryOf(std::int64_t id, const std::string& key = "") {
    auto entry = std::make_shared<IndexEntry>();
    entry->id = id;
    entry->key = key;
    entry->signature.points.resize(1);
    return entry;
}

// The entries themselves (not copies of them), in order, in blocks of legal sizes.
void expectHolds(const SignatureSet& set, const Model& model) {
    ASSERT_EQ(set.size(), model.size());
    auto expected = model.begin();
    for (const auto& block : set.blocks()) {
        ASSERT_FALSE(block->empty());
        ASSERT_LE(block->size(), SignatureSet::kBlockSize);
        for (const EntryPtr& entry : *block) {
            ASSERT_NE(expected, model.end());
            ASSERT_EQ(entry.get(), expected->second.get()) << "id " << expected->first;
            ++expected;
        }
    }
    ASSERT_EQ(expected, model.end());
}

void expectFinds(const SignatureSet& set, const Model& model, Random& random, std::int64_t highest) {
    for (int i = 0; i < 200; ++i) {
        const auto id = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(highest) + 10));
        const auto known = model.find(id);
        ASSERT_EQ(set.find(id), known == model.end() ? nullptr : known->second) << "id " << id;
    }
    EXPECT_EQ(set.find(-1), nullptr);
}

struct Change {
    std::vector<EntryPtr> updates;
    std::vector<std::int64_t> removed;
};

// Mostly a few ids, sometimes thousands; sometimes a whole range, so that blocks split and empty.
Change randomChange(Random& random, const Model& model, std::int64_t highest) {
    Change change;
    std::map<std::int64_t, bool> ids;
    const auto anyId = [&] {
        return 1 + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(highest)));
    };
    const std::uint64_t style = random.below(6);
    if (style == 0) {
        const std::int64_t from = anyId();
        const std::int64_t to = from + static_cast<std::int64_t>(random.below(4000));
        for (auto it = model.lower_bound(from); it != model.end() && it->first <= to; ++it) {
            ids[it->first] = false;
        }
    } else if (style == 1) {
        const std::int64_t from = anyId();
        for (std::int64_t id = from; id < from + 1500; ++id) ids[id] = true;
    } else {
        const std::uint64_t count = style == 2 ? random.below(2000) : random.below(5);
        for (std::uint64_t i = 0; i < count; ++i) ids[anyId()] = random.below(3) != 0;
    }
    for (const auto& [id, inserts] : ids) {
        if (inserts) {
            change.updates.push_back(entryOf(id));
        } else {
            change.removed.push_back(id);
        }
    }
    for (std::size_t i = change.updates.size(); i > 1; --i) {
        std::swap(change.updates[i - 1], change.updates[random.below(i)]);
    }
    std::reverse(change.removed.begin(), change.removed.end());
    return change;
}

void applyTo(Model& model, const Change& change) {
    for (const EntryPtr& entry : change.updates) model[entry->id] = entry;
    for (const std::int64_t id : change.removed) model.erase(id);
}

TEST(SignatureSet, BehavesAsAMapUnderRandomChanges) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        Random random(seed);
        SignatureSet set;
        Model model;
        std::vector<std::pair<SignatureSet, Model>> kept;
        std::int64_t highest = 0;
        for (int step = 0; step < 300; ++step) {
            highest = step < 150 ? 12000 : 60000;
            const Change change = randomChange(random, model, highest);
            set = set.with(change.updates, change.removed);
            applyTo(model, change);
            expectHolds(set, model);
            expectFinds(set, model, random, highest);
            if (HasFatalFailure()) FAIL() << "seed " << seed << " step " << step;
            if (step % 50 == 0) kept.emplace_back(set, model);
        }
        // Snapshots taken on the way are as they were.
        for (const auto& [snapshot, then] : kept) expectHolds(snapshot, then);
        EXPECT_GT(model.size(), 5000u);
    }
}

TEST(SignatureSet, IsEmptyAtFirstAndAgain) {
    const SignatureSet empty;
    EXPECT_EQ(empty.size(), 0u);
    EXPECT_EQ(empty.memoryBytes(), 0u);
    EXPECT_TRUE(empty.blocks().empty());
    EXPECT_EQ(empty.find(1), nullptr);
    EXPECT_EQ(empty.with({}, {1, 2, 3}).size(), 0u);

    std::vector<EntryPtr> entries;
    std::vector<std::int64_t> ids;
    for (std::int64_t id = 1; id <= 5000; ++id) {
        entries.push_back(entryOf(id));
        ids.push_back(id);
    }
    const SignatureSet full = empty.with(entries, {});
    const SignatureSet again = full.with({}, ids);
    EXPECT_EQ(again.size(), 0u);
    EXPECT_TRUE(again.blocks().empty());
    EXPECT_EQ(again.find(17), nullptr);
    EXPECT_EQ(full.size(), 5000u);
}

TEST(SignatureSet, DropsABlockThatBecomesEmpty) {
    std::vector<EntryPtr> entries;
    for (std::int64_t id = 1; id <= 3 * 1024; ++id) entries.push_back(entryOf(id));
    const SignatureSet set = SignatureSet().with(entries, {});
    ASSERT_EQ(set.blocks().size(), 3u);
    for (std::size_t b = 0; b < 3; ++b) {
        std::vector<std::int64_t> ids;
        for (const EntryPtr& entry : *set.blocks()[b]) ids.push_back(entry->id);
        const SignatureSet without = set.with({}, ids);
        ASSERT_EQ(without.blocks().size(), 2u);
        EXPECT_EQ(without.size(), 2048u);
        EXPECT_EQ(without.find(ids.front()), nullptr);
        // The range it answered for is open to others again.
        const SignatureSet back = without.with({entryOf(ids[500])}, {});
        EXPECT_NE(back.find(ids[500]), nullptr);
        EXPECT_EQ(back.size(), 2049u);
    }
}

TEST(SignatureSet, SharesTheBlocksAChangeDoesNotTouch) {
    std::vector<EntryPtr> entries;
    for (std::int64_t id = 1; id <= 10 * 1024; ++id) entries.push_back(entryOf(2 * id));
    const SignatureSet set = SignatureSet().with(entries, {});
    const auto shared = [&](const SignatureSet& other) {
        std::size_t count = 0;
        for (const auto& block : other.blocks()) {
            count += static_cast<std::size_t>(std::count(set.blocks().begin(), set.blocks().end(), block));
        }
        return count;
    };
    EXPECT_EQ(shared(set.with({entryOf(4097)}, {})), 9u);
    EXPECT_EQ(shared(set.with({}, {4096})), 9u);
    EXPECT_EQ(shared(set.with({entryOf(1000000)}, {})), 9u);
    EXPECT_EQ(shared(set.with({}, {1000000, 3, -5})), 9u);  // 3 may be in the first block
    EXPECT_EQ(shared(set.with({}, {})), 10u);
}

// Workers finish out of order: late ids must not leave blocks of one entry behind.
TEST(SignatureSet, StaysInFewBlocksWhateverTheOrderOfArrival) {
    const std::int64_t count = 8000;
    Random random(5);
    std::vector<std::vector<std::int64_t>> orders(4);
    for (std::int64_t id = 1; id <= count; ++id) {
        orders[0].push_back(id);
        orders[1].push_back(count + 1 - id);
        orders[2].push_back(id % 2 == 0 ? id - 1 : id + 1);
        orders[3].push_back(id);
    }
    for (std::size_t i = orders[3].size(); i > 1; --i) {
        std::swap(orders[3][i - 1], orders[3][random.below(i)]);
    }
    for (const auto& order : orders) {
        SignatureSet set;
        Model model;
        for (const std::int64_t id : order) {
            const EntryPtr entry = entryOf(id);
            set = set.with({entry}, {});
            model[id] = entry;
        }
        expectHolds(set, model);
        EXPECT_LE(set.blocks().size(), 2 * static_cast<std::size_t>(count) / SignatureSet::kBlockSize + 1);
    }
}

TEST(SignatureSet, CountsTheMemoryOfWhatItHolds) {
    auto entry = std::make_shared<IndexEntry>();
    entry->id = 1;
    entry->key = std::string(1000, 'k');
    entry->metadata["label"] = std::string(2000, 'v');
    entry->signature.points.resize(7);
    const std::size_t bytes = SignatureSet().with({entry}, {}).memoryBytes();
    EXPECT_GT(bytes, 3000u + 7 * sizeof(SignaturePoint) + sizeof(IndexEntry));
    EXPECT_LT(bytes, 3000u + 7 * sizeof(SignaturePoint) + sizeof(IndexEntry) + 300);

    std::vector<EntryPtr> many;
    for (std::int64_t id = 1; id <= 1000; ++id) many.push_back(entryOf(id));
    const std::size_t thousand = SignatureSet().with(many, {}).memoryBytes();
    EXPECT_EQ(thousand, 1000 * SignatureSet().with({many.front()}, {}).memoryBytes());
}

}  // namespace
}  // namespace shapedb
