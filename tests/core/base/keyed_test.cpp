#include "core/base/keyed.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

void expectStablySorted(std::vector<Keyed> keyed) {
    std::vector<Keyed> expected = keyed;
    std::stable_sort(expected.begin(), expected.end(),
                     [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
    sortByKey(keyed);
    ASSERT_EQ(keyed.size(), expected.size());
    for (std::size_t i = 0; i < keyed.size(); ++i) {
        ASSERT_EQ(keyed[i].key, expected[i].key) << i;
        ASSERT_EQ(keyed[i].index, expected[i].index) << i;
    }
}

std::vector<Keyed> randomKeys(std::size_t count, std::uint64_t mask, std::uint64_t seed) {
    Random random(seed);
    std::vector<Keyed> keyed;
    for (std::uint32_t i = 0; i < count; ++i) keyed.push_back({random.below(~std::uint64_t{0}) & mask, i});
    return keyed;
}

TEST(SortByKey, IsAStableSort) {
    expectStablySorted({});
    expectStablySorted({{7, 0}});
    for (const std::size_t count : {2U, 100U, 5000U}) {
        expectStablySorted(randomKeys(count, ~std::uint64_t{0}, count));
    }
}

// Digits that all keys share are left out: the lowest, the highest, those between, all of them.
TEST(SortByKey, OfKeysThatAgreeInSomeDigits) {
    for (const std::uint64_t mask : {std::uint64_t{0}, std::uint64_t{0x7ff}, std::uint64_t{3} << 62,
                                     std::uint64_t{0xff0000000000ff}, std::uint64_t{0xff} << 20}) {
        expectStablySorted(randomKeys(3000, mask, mask + 1));
    }
}

}  // namespace
}  // namespace shapedb
