// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/signature_set.h"

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/matching/attributed_signatures.h"

namespace shapedb {
namespace {

// Id to the number of the change that put it there.
using Model = std::map<std::int64_t, std::size_t>;

IndexEntry entryOf(std::int64_t id, std::size_t version = 1) {
    IndexEntry entry;
    entry.id = id;
    entry.metadata["version"] = std::to_string(version);
    entry.signature.scale = static_cast<double>(version);
    entry.signature.points.resize(1 + static_cast<std::size_t>(id) % 3);
    entry.signature.points.back().weight = static_cast<float>(id);
    return entry;
}

// The same entry, in all its arrays.
void expectIs(const SignatureBlock& block, std::size_t row, std::int64_t id, std::size_t version) {
    ASSERT_EQ(block.id(row), id);
    ASSERT_EQ(block.metadata(row).at("version"), std::to_string(version)) << "id " << id;
    ASSERT_FALSE(block.attributed(row));
    const ShapeRow shape = block.rows()[row];
    ASSERT_EQ(shape.scale, static_cast<double>(version));
    ASSERT_EQ(shape.pointCount, 1 + static_cast<std::size_t>(id) % 3);
    ASSERT_EQ(shape.points[shape.pointCount - 1].weight, static_cast<float>(id));
}

// The entries as they were last stored, in order, in blocks of legal sizes.
void expectHolds(const SignatureSet& set, const Model& model) {
    ASSERT_EQ(set.size(), model.size());
    auto expected = model.begin();
    for (const auto& block : set.blocks()) {
        ASSERT_GT(block->size(), 0u);
        ASSERT_LE(block->size(), SignatureSet::kBlockSize);
        for (std::size_t row = 0; row < block->size(); ++row) {
            ASSERT_NE(expected, model.end());
            expectIs(*block, row, expected->first, expected->second);
            ++expected;
        }
    }
    ASSERT_EQ(expected, model.end());
}

void expectFinds(const SignatureSet& set, const Model& model, Random& random, std::int64_t highest) {
    for (int i = 0; i < 200; ++i) {
        const auto id = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(highest) + 10));
        const auto known = model.find(id);
        const SignatureSet::Place place = set.find(id);
        ASSERT_EQ(static_cast<bool>(place), known != model.end()) << "id " << id;
        if (place) expectIs(*place.block, place.row, id, known->second);
    }
    EXPECT_FALSE(set.find(-1));
}

struct Change {
    std::vector<IndexEntry> updates;
    std::vector<std::int64_t> removed;
};

// Mostly a few ids, sometimes thousands; sometimes a whole range, so that blocks split and empty.
Change randomChange(Random& random, const Model& model, std::int64_t highest, std::size_t version) {
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
            change.updates.push_back(entryOf(id, version));
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

void applyTo(Model& model, const Change& change, std::size_t version) {
    for (const IndexEntry& entry : change.updates) model[entry.id] = version;
    for (const std::int64_t id : change.removed) model.erase(id);
}

TEST(SignatureSet, EqualsAMapUnderRandomChanges) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        Random random(seed);
        SignatureSet set;
        Model model;
        std::vector<std::pair<SignatureSet, Model>> kept;
        std::int64_t highest = 0;
        for (std::size_t step = 0; step < 300; ++step) {
            highest = step < 150 ? 12000 : 60000;
            const Change change = randomChange(random, model, highest, step);
            set = set.with(change.updates, change.removed);
            applyTo(model, change, step);
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

TEST(SignatureSet, MadeOfBlocksIsASetLikeAnyOther) {
    Model model;
    std::vector<std::shared_ptr<const SignatureBlock>> blocks;
    std::int64_t id = 0;
    for (const std::size_t rows : {1000U, 0U, 1U, 1024U}) {
        auto block = std::make_shared<SignatureBlock>();
        for (std::size_t i = 0; i < rows; ++i) {
            id += 2;
            block->append(entryOf(id));
            model[id] = 1;
        }
        blocks.push_back(block);
    }
    SignatureSet set = SignatureSet::ofBlocks(blocks);
    expectHolds(set, model);
    Random random(4);
    expectFinds(set, model, random, id);
    set = set.with({entryOf(3, 7), entryOf(id + 1, 8)}, {2, 2002});
    model[3] = 7;
    model[id + 1] = 8;
    model.erase(2);
    model.erase(2002);
    expectHolds(set, model);
    EXPECT_EQ(SignatureSet::ofBlocks({}).size(), 0U);
}

TEST(SignatureSet, IsEmptyAtFirstAndAfterRemovingAll) {
    const SignatureSet empty;
    EXPECT_EQ(empty.size(), 0u);
    EXPECT_EQ(empty.memoryBytes(), 0u);
    EXPECT_TRUE(empty.blocks().empty());
    EXPECT_FALSE(empty.find(1));
    EXPECT_EQ(empty.with({}, {1, 2, 3}).size(), 0u);

    std::vector<IndexEntry> entries;
    std::vector<std::int64_t> ids;
    for (std::int64_t id = 1; id <= 5000; ++id) {
        entries.push_back(entryOf(id));
        ids.push_back(id);
    }
    const SignatureSet full = empty.with(entries, {});
    const SignatureSet again = full.with({}, ids);
    EXPECT_EQ(again.size(), 0u);
    EXPECT_TRUE(again.blocks().empty());
    EXPECT_FALSE(again.find(17));
    EXPECT_EQ(full.size(), 5000u);
}

TEST(SignatureSet, DropsABlockThatBecomesEmpty) {
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 3 * 1024; ++id) entries.push_back(entryOf(id));
    const SignatureSet set = SignatureSet().with(entries, {});
    ASSERT_EQ(set.blocks().size(), 3u);
    for (std::size_t b = 0; b < 3; ++b) {
        std::vector<std::int64_t> ids;
        const SignatureBlock& block = *set.blocks()[b];
        for (std::size_t row = 0; row < block.size(); ++row) ids.push_back(block.id(row));
        const SignatureSet without = set.with({}, ids);
        ASSERT_EQ(without.blocks().size(), 2u);
        EXPECT_EQ(without.size(), 2048u);
        EXPECT_FALSE(without.find(ids.front()));
        // Its range of ids is free for others again.
        const SignatureSet back = without.with({entryOf(ids[500])}, {});
        EXPECT_TRUE(back.find(ids[500]));
        EXPECT_EQ(back.size(), 2049u);
    }
}

TEST(SignatureSet, SharesTheBlocksAChangeDoesNotTouch) {
    std::vector<IndexEntry> entries;
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
    EXPECT_EQ(shared(set.with({entryOf(1000000)}, {})), 10u) << "the last is full, so a new one begins";
    EXPECT_EQ(shared(set.with({}, {1000000, 3, -5})), 9u);  // 3 may be in the first block
    EXPECT_EQ(shared(set.with({}, {})), 10u);
}

// Workers finish out of order: late ids must not leave blocks of one entry.
TEST(SignatureSet, StaysInFewBlocksInAnyOrderOfArrival) {
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
            set = set.with({entryOf(id)}, {});
            model[id] = 1;
        }
        expectHolds(set, model);
        EXPECT_LE(set.blocks().size(), 2 * static_cast<std::size_t>(count) / SignatureSet::kBlockSize + 1);
    }
}

// What a search keeps of a shape: the issue of fitting many of them into memory.
TEST(SignatureSet, KeepsAShapeInFewBytes) {
    Random random(6);
    std::vector<IndexEntry> entries;
    for (std::int64_t id = 1; id <= 5000; ++id) {
        IndexEntry entry;
        entry.id = id;
        entry.signature = testing_support::randomAttributed(random, kMaxSignaturePoints);
        entries.push_back(std::move(entry));
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    EXPECT_LE(set.memoryBytes() / entries.size(), 512u);
    EXPECT_GT(set.memoryBytes() / entries.size(), 256u + sizeof(PackedSegmentDescriptor));
}

TEST(SignatureSet, CountsItsMemory) {
    IndexEntry entry = entryOf(1);
    const std::size_t before = SignatureSet().with({entry}, {}).memoryBytes();
    entry.metadata["label"] = std::string(2000, 'v');
    const std::size_t labelled = SignatureSet().with({entry}, {}).memoryBytes();
    EXPECT_GT(labelled, before + 2000u);
    EXPECT_LT(labelled, before + 2000u + 200u);
    // Metadata that many share are kept once.
    std::vector<IndexEntry> many;
    for (std::int64_t id = 1; id <= 1000; ++id) {
        many.push_back(entry);
        many.back().id = id;
    }
    EXPECT_LT(SignatureSet().with(many, {}).memoryBytes(), labelled + 1000u * 120u);
}

TEST(SignatureSet, PartsAreFoundAsOneSet) {
    std::vector<SignatureSet> parts(4);  // the third stays empty
    for (std::int64_t id = 1; id <= 3000; ++id) {
        const std::size_t part = id % 3 == 2 ? 3 : static_cast<std::size_t>(id % 3);
        parts[part] = parts[part].with({entryOf(id)}, {});
    }
    const SignatureSet all = SignatureSet::ofParts(parts);
    ASSERT_EQ(all.size(), 3000u);
    for (std::int64_t id = 1; id <= 3000; ++id) {
        const SignatureSet::Place place = all.find(id);
        ASSERT_TRUE(place) << id;
        expectIs(*place.block, place.row, id, 1);
    }
    EXPECT_FALSE(all.find(0));
    EXPECT_FALSE(all.find(3001));
    EXPECT_FALSE(SignatureSet::ofParts({}).find(1));
}

}  // namespace
}  // namespace shapedb
