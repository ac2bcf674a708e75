// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/scene.h"

#include <atomic>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "core/synthetic/solid.h"

namespace shapedb {
namespace {

PointCloud memberOf(const std::string& family, std::size_t index, std::size_t count) {
    ScanOptions options;
    options.count = count;
    options.randomPose = false;
    options.noise = 0.002;
    return scanOf(makeMember(family, index, 1).value(), options).value();
}

PointCloud turned(const PointCloud& cloud, std::uint64_t seed) {
    Random random(seed);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.translation = {1.0, -2.0, 3.0};
    return applyToCloud(motion, cloud);
}

struct Found {
    double recall = 0.0;  // of the table's points
    double lost = 0.0;    // of the object's
};

Found measure(const Scene& scene, std::size_t objectPoints) {
    Found found;
    const std::size_t all = scene.objectOfPoint.size();
    for (std::size_t i = 0; i < all; ++i) {
        const bool on = scene.objectOfPoint[i] == kOnPlane;
        if (i < objectPoints) {
            found.lost += on ? 1.0 / static_cast<double>(objectPoints) : 0.0;
        } else {
            found.recall += on ? 1.0 / static_cast<double>(all - objectPoints) : 0.0;
        }
    }
    return found;
}

TEST(Scene, FindsTheTableUnderEveryObjectInAnyPose) {
    std::size_t seed = 1;
    for (const FamilyInfo& family : listFamilies()) {
        for (const bool oneSided : {false, true}) {
            Random random(++seed);
            PointCloud cloud = memberOf(family.name, 2, 6000);
            if (oneSided) cloud = seenFrom(cloud, {0.6, 0.0, 0.8});
            const std::size_t own = cloud.size();
            addTable(cloud, 6000, 2.5, 0.002, random.next());
            const auto scene = findScene(turned(cloud, seed));
            ASSERT_TRUE(scene) << family.name;
            ASSERT_TRUE(scene->plane) << family.name << (oneSided ? ", one side" : "");
            const Found found = measure(*scene, own);
            EXPECT_GT(found.recall, 0.98) << family.name;
            EXPECT_LT(found.lost, 0.25)
                << family.name << ": a flat spoon lies on the table with a fifth of itself";
            EXPECT_NEAR(length(scene->plane->normal), 1.0, 1e-9);
        }
    }
}

TEST(Scene, FindsNoTableUnderAnObjectAlone) {
    for (const FamilyInfo& family : listFamilies()) {
        for (std::size_t member = 0; member < 3; ++member) {
            const auto scene = findScene(turned(memberOf(family.name, member, 5000), member));
            ASSERT_TRUE(scene);
            EXPECT_FALSE(scene->plane) << family.name << " " << member;
            EXPECT_EQ(scene->objects.size(), 1u) << family.name << " " << member;
        }
    }
}

// Flat cutlery, both sides of it: a handle, and a head that leaves its plane. Length 1.
PointCloud cutlery(bool fork, std::uint64_t seed) {
    Random random(seed);
    const double width = random.uniform(0.06, 0.12);
    const double thickness = random.uniform(0.004, 0.015);
    const double depth = random.uniform(0.02, 0.08);
    const double head = random.uniform(0.25, 0.4);
    const double headWidth = random.uniform(0.14, 0.24);
    PointCloud cloud;
    while (cloud.size() < 4000) {
        const double along = random.uniform();
        const double across = random.uniform(-1.0, 1.0);
        const double u = (along - (1.0 - head)) / head;
        Point3 p{along, across * width / 2.0, 0.0};
        if (u > 0.0) {
            p.y = across * headWidth / 2.0;
            const double a = 2.0 * u - 1.0;
            const bool gap = u > 0.4 && static_cast<int>((across + 1.0) * 3.5) % 2 == 1;
            if (fork ? gap : a * a + across * across > 1.0) continue;
            p.z = fork ? 2.0 * depth * u * (2.0 * u - 1.0) : -depth * (1.0 - a * a - across * across);
        }
        p.z += (random.uniform() < 0.5 ? -0.5 : 0.5) * thickness;
        cloud.push_back(p);
    }
    return cloud;
}

TEST(Scene, TheFlatHandleOfASpoonIsNoTable) {
    std::size_t tables = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        for (const bool fork : {false, true}) {
            PointCloud cloud = cutlery(fork, seed);
            const auto alone = findScene(turned(cloud, seed));
            ASSERT_TRUE(alone);
            EXPECT_FALSE(alone->plane) << (fork ? "fork " : "spoon ") << seed;
            addTable(cloud, 6000, 1.5, 0.001, seed);
            const auto laid = findScene(turned(cloud, seed));
            ASSERT_TRUE(laid);
            tables += laid->plane && measure(*laid, 4000).recall > 0.9 ? 1 : 0;
        }
    }
    EXPECT_GE(tables, 36u) << "a fork that lies flat is hardly above the table";
}

TEST(Scene, TellsSeparateObjectsOnATableApart) {
    Random random(5);
    PointCloud cloud;
    std::vector<std::size_t> sizes;
    for (int i = 0; i < 3; ++i) {
        const PointCloud one =
            memberOf("hammer", static_cast<std::size_t>(i), 5000 - 1000 * static_cast<std::size_t>(i));
        const Box box = boxOf(one);
        for (const Point3& p : one) {
            cloud.push_back(p - Point3{0.0, 0.0, box.low.z} + Point3{0.0, 3.0 * i * box.extent().y, 0.0});
        }
        sizes.push_back(one.size());
    }
    const std::size_t own = cloud.size();
    addTable(cloud, 30000, 1.5, 0.002, random.next());
    const auto scene = findScene(cloud);
    ASSERT_TRUE(scene);
    ASSERT_TRUE(scene->plane);
    EXPECT_GT(scene->plane->normal.z, 0.99) << "towards the objects";
    ASSERT_EQ(scene->objects.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(static_cast<double>(scene->objects[i]), static_cast<double>(sizes[i]),
                    0.2 * static_cast<double>(sizes[i]));
        EXPECT_EQ(pointsOfObject(cloud, *scene, i).size(), scene->objects[i]);
    }
    const PointCloud largest = isolated(cloud, *scene, {false, true});
    EXPECT_EQ(largest.size(), scene->objects[0]);
    const PointCloud above = isolated(cloud, *scene, {true, false});
    EXPECT_LT(above.size(), own + own / 50);
    EXPECT_GT(above.size(), own * 8 / 10);
    EXPECT_EQ(isolated(cloud, *scene, {}).size(), cloud.size());
}

TEST(Scene, OneOfAHundredEqualObjectsIsAnObject) {
    const PointCloud ball = *sampleBoundary(makeSphere().solid, 300, 1);
    const double step = 3.0 * boxOf(ball).diagonal();
    PointCloud cloud;
    for (int i = 0; i < 100; ++i) {
        for (const Point3& p : ball) cloud.push_back(p + Point3{step * (i % 10), step * (i / 10), 0.0});
    }
    const auto scene = findScene(cloud);
    ASSERT_TRUE(scene);
    EXPECT_EQ(scene->objects.size(), 100u);
    EXPECT_EQ(isolated(cloud, *scene, {false, true}).size(), ball.size());
}

TEST(Scene, PointsThatStandManyTimesAreNoObjectsOfTheirOwn) {
    const PointCloud one = memberOf("hammer", 1, 1500);
    PointCloud cloud;
    for (std::size_t i = 0; i < one.size(); ++i) cloud.insert(cloud.end(), i % 3 == 0 ? 10 : 1, one[i]);
    const auto scene = findScene(cloud);
    ASSERT_TRUE(scene);
    EXPECT_EQ(scene->objects, std::vector<std::uint64_t>{cloud.size()});
}

TEST(Scene, CopesWithFewAndDegeneratePoints) {
    EXPECT_TRUE(findScene({})->objects.empty());
    EXPECT_EQ(findScene(PointCloud(5, Point3{1, 2, 3}))->objects.front(), 5u);
    EXPECT_FALSE(findScene(PointCloud(100, Point3{1, 2, 3}))->plane);
    PointCloud flat;
    for (int i = 0; i < 400; ++i)
        flat.push_back({static_cast<double>(i % 20), static_cast<double>(i / 20), 0.0});
    EXPECT_FALSE(findScene(flat)->plane) << "nothing stands on it";
}

TEST(Scene, StopsWhenCancelled) {
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto stopped = findScene(memberOf("hammer", 0, 1000), context);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
