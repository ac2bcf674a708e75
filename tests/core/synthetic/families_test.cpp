// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/families.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/disjoint_sets.h"

namespace shapedb {
namespace {

Solid member(const std::string& family, std::size_t index, std::uint64_t seed) {
    const auto solid = makeMember(family, index, seed);
    EXPECT_TRUE(solid) << family;
    return solid ? *solid : Solid{};
}

// Whether every part is connected to the first by points that two parts share.
bool isConnected(const Solid& solid) {
    DisjointSets groups(solid.parts.size());
    for (std::uint32_t i = 0; i < solid.parts.size(); ++i) {
        const auto own = sampleBoundary({{solid.parts[i]}}, 1500, i);
        if (!own) return false;
        for (std::uint32_t j = 0; j < solid.parts.size(); ++j) {
            const bool touches = std::any_of(own->begin(), own->end(), [&](const Point3& p) {
                return implicitValue(solid.parts[j], p) <= 0.0;
            });
            if (touches) groups.unite(i, j);
        }
    }
    for (std::uint32_t i = 1; i < solid.parts.size(); ++i) {
        if (groups.find(i) != groups.find(0)) return false;
    }
    return true;
}

TEST(Families, AreSortedByName) {
    const auto families = listFamilies();
    EXPECT_GE(families.size(), 8U);
    for (std::size_t i = 0; i < families.size(); ++i) {
        EXPECT_FALSE(families[i].description.empty());
        if (i > 0) {
            EXPECT_LT(families[i - 1].name, families[i].name);
        }
        EXPECT_TRUE(std::all_of(families[i].name.begin(), families[i].name.end(),
                                [](char c) { return c >= 'a' && c <= 'z'; }));
    }
}

TEST(Families, EveryMemberIsValidAndNowhereTooThin) {
    for (const FamilyInfo& family : listFamilies()) {
        for (std::size_t index = 0; index < 400; ++index) {
            const Solid solid = member(family.name, index, 1 + index % 3);
            const auto valid = checkSolid(solid);
            ASSERT_TRUE(valid) << family.name << " " << index << ": " << valid.error().message;
            const double diagonal = boundsOf(solid).diagonal();
            EXPECT_GT(diagonal, 0.5) << family.name << " " << index;
            EXPECT_LT(diagonal, 5.0) << family.name << " " << index;
            EXPECT_GE(thinnestPart(solid) / diagonal, 0.03) << family.name << " " << index;
        }
    }
}

TEST(Families, EveryMemberIsInOnePiece) {
    for (const FamilyInfo& family : listFamilies()) {
        for (std::size_t index = 0; index < 8; ++index) {
            EXPECT_TRUE(isConnected(member(family.name, index, 7))) << family.name << " " << index;
        }
    }
}

TEST(Families, MembersAreReproducibleAndDiffer) {
    for (const FamilyInfo& family : listFamilies()) {
        std::set<double> volumes;
        std::set<double> diagonals;
        for (std::size_t index = 0; index < 10; ++index) {
            const Solid solid = member(family.name, index, 5);
            volumes.insert(volumeOf(solid, 20000));
            diagonals.insert(boundsOf(solid).diagonal());
            EXPECT_EQ(volumeOf(member(family.name, index, 5), 20000), volumeOf(solid, 20000));
        }
        EXPECT_EQ(diagonals.size(), 10U) << family.name;
        EXPECT_GT(*volumes.rbegin(), 1.2 * *volumes.begin()) << family.name << ": members hardly differ";
        EXPECT_NE(boundsOf(member(family.name, 0, 5)).diagonal(),
                  boundsOf(member(family.name, 0, 6)).diagonal());
    }
}

TEST(Families, UnknownFamilyListsTheKnownOnes) {
    const auto solid = makeMember("unicorn", 0, 1);
    ASSERT_FALSE(solid);
    EXPECT_EQ(solid.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(solid.error().message.find("\"unicorn\""), std::string::npos);
    EXPECT_NE(solid.error().message.find("octopus"), std::string::npos);
}

TEST(Scan, CleanScanIsOnTheBoundary) {
    const Solid solid = member("animal", 0, 1);
    ScanOptions options;
    options.count = 3000;
    options.randomPose = false;
    const auto points = scanOf(solid, options);
    ASSERT_TRUE(points);
    ASSERT_EQ(points->size(), 3000U);
    for (const Point3& p : *points) {
        double nearest = 1e9;
        for (const SolidPart& part : solid.parts) nearest = std::min(nearest, implicitValue(part, p));
        EXPECT_NEAR(nearest, 0.0, 1e-9);
    }
}

TEST(Scan, NoiseIsAShareOfTheDiagonal) {
    const Solid solid = member("mug", 2, 1);
    ScanOptions options;
    options.randomPose = false;
    const auto clean = scanOf(solid, options);
    options.noise = 0.01;
    const auto noisy = scanOf(solid, options);
    ASSERT_TRUE(clean && noisy);
    double squares = 0.0;
    for (std::size_t i = 0; i < clean->size(); ++i) squares += squaredDistance((*clean)[i], (*noisy)[i]);
    const double sigma = std::sqrt(squares / (3.0 * static_cast<double>(clean->size())));
    const double expected = 0.01 * boundsOf(solid).diagonal();
    EXPECT_NEAR(sigma, expected, 0.02 * expected);
}

// The pose is a similarity motion: all distances change by the same factor, and handedness is kept.
TEST(Scan, RandomPoseIsAMotionOfTheSameScan) {
    const Solid solid = member("hammer", 1, 1);
    std::set<double> scales;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        ScanOptions options;
        options.count = 200;
        options.noise = 0.005;
        options.seed = seed;
        const auto posed = scanOf(solid, options);
        options.randomPose = false;
        const auto still = scanOf(solid, options);
        ASSERT_TRUE(posed && still);
        const auto& a = *still;
        const auto& b = *posed;
        const double scale = distance(b[0], b[1]) / distance(a[0], a[1]);
        EXPECT_GE(scale, 0.1);
        EXPECT_LE(scale, 10.0);
        scales.insert(scale);
        for (std::size_t i = 2; i < a.size(); ++i) {
            EXPECT_NEAR(distance(b[0], b[i]), scale * distance(a[0], a[i]), 1e-9 * scale);
        }
        const auto handed = [](const PointCloud& p) {
            return dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0]));
        };
        EXPECT_GT(handed(a) * handed(b), 0.0);
    }
    EXPECT_EQ(scales.size(), 5U);
}

TEST(Scan, RefusesBadOptions) {
    const Solid solid = member("table", 0, 1);
    ScanOptions options;
    options.count = 0;
    EXPECT_EQ(scanOf(solid, options).error().code, ErrorCode::kInvalidArgument);
    options.count = 10;
    options.noise = -1.0;
    EXPECT_EQ(scanOf(solid, options).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(scanOf({}, ScanOptions{}).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb
