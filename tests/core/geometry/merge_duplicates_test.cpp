// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/merge_duplicates.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

TEST(MergeDuplicates, AgreesWithASet) {
    Random random(7);
    PointCloud points;
    for (int i = 0; i < 500; ++i) {
        points.push_back({static_cast<double>(random.below(4)), static_cast<double>(random.below(4)),
                          static_cast<double>(random.below(4))});
    }
    const auto less = [](const Point3& a, const Point3& b) { return lexicographicLess(a, b); };
    const std::set<Point3, decltype(less)> expected(points.begin(), points.end(), less);
    const MergedPoints merged = mergeDuplicates(points);
    ASSERT_EQ(merged.points.size(), expected.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), merged.points.begin()));
    for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ(merged.points[merged.siteOfPoint[i]], points[i]);
    EXPECT_TRUE(mergeDuplicates({}).points.empty());
}

}  // namespace
}  // namespace shapedb
