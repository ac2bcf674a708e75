// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/segmentation/small_clouds.h"

#include <stdexcept>
#include <utility>

#include "core/base/random.h"
#include "core/preparation/sanitise.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {

namespace {

Point3 randomPoint(Random& random) {
    return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

PointCloud uniformCube(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) points.push_back(randomPoint(random));
    return points;
}

PointCloud onSphere(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        const Point3 p{random.normal(), random.normal(), random.normal()};
        points.push_back((1.0 / length(p)) * p);
    }
    return points;
}

PointCloud grid(int side, double step, const Point3& at) {
    PointCloud points;
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            for (int k = 0; k < side; ++k) points.push_back(at + Point3{i * step, j * step, k * step});
        }
    }
    return points;
}

// All integer points with x^2 + y^2 + z^2 = 26: 72 exactly cospherical points, with the centre or not.
PointCloud integerSphere(bool withCentre) {
    PointCloud points;
    for (int x = -5; x <= 5; ++x) {
        for (int y = -5; y <= 5; ++y) {
            for (int z = -5; z <= 5; ++z) {
                if (x * x + y * y + z * z == 26) {
                    points.push_back(
                        {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
                }
            }
        }
    }
    if (withCentre) points.push_back({0, 0, 0});
    return points;
}

PointCloud noisyShape(const NamedShape& shape, std::size_t count, double noise, std::uint64_t seed) {
    PointCloud points = sampleBoundary(shape.solid, count, seed).value();
    if (!addGaussianNoise(points, noise, seed)) throw std::logic_error("noise");
    return points;
}

PointCloud together(PointCloud a, const PointCloud& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

std::vector<SmallCloud> makeClouds() {
    std::vector<SmallCloud> clouds;
    const auto add = [&](std::string name, const PointCloud& points) {
        clouds.push_back({std::move(name), sanitise(points).value().points});
    };
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        add("uniform " + std::to_string(seed), uniformCube(150, seed));
        add("sphere " + std::to_string(seed), onSphere(120, seed));
        add("noisy dumbbell " + std::to_string(seed), noisyShape(makeDumbbell(), 250, 0.004, seed));
        add("noisy L " + std::to_string(seed), noisyShape(makeLShape(), 200, 0.008, seed));
    }
    add("clean box", noisyShape(makeBox(), 250, 0.0, 9));
    add("clean torus", noisyShape(makeTorus(), 300, 0.0, 9));
    add("one tetrahedron", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    add("cube corners", grid(2, 1.0, {}));
    add("grid", grid(6, 1.0, {}));
    add("grid of thirds", grid(5, 1.0 / 3.0, {0.1, 0.2, 0.3}));
    add("integer sphere", integerSphere(false));
    add("integer sphere with centre", integerSphere(true));
    // Tetrahedra a ten-millionth of the frame, far from its origin: a grid but for the last digits.
    add("tiny grid in a large frame", [] {
        Random random(6);
        PointCloud points = grid(5, 1e-7, {0.71, 0.63, 0.57});
        for (Point3& p : points) p = p + 1e-15 * randomPoint(random);
        return together(points, uniformCube(40, 5));
    }());
    add("flat", [] {
        PointCloud points = uniformCube(200, 8);
        for (Point3& p : points) p.z *= 1e-5;
        return points;
    }());
    return clouds;
}

}  // namespace

const std::vector<SmallCloud>& smallClouds() {
    static const std::vector<SmallCloud> clouds = makeClouds();
    return clouds;
}

const std::vector<Triangulated>& triangulatedClouds() {
    static const std::vector<Triangulated> all = [] {
        std::vector<Triangulated> made;
        for (const SmallCloud& cloud : smallClouds()) {
            made.push_back({cloud.name, cloud.points, triangulate(cloud.points).value()});
        }
        return made;
    }();
    return all;
}

std::array<Point3, 4> cornersOf(const Triangulated& cloud, std::size_t t) {
    std::array<Point3, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = cloud.points[cloud.tetrahedra.vertices[t][i]];
    return corners;
}

}  // namespace shapedb
