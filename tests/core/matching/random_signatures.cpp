// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/matching/random_signatures.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "core/matching/score.h"

namespace shapedb::testing_support {

namespace {

Point3 inBall(Random& random, double radius) {
    Point3 p{2.0, 0.0, 0.0};
    while (squaredLength(p) > 1.0) p = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    return radius * p;
}

Point3 latticePoint(Random& random) {
    const auto step = [&] { return 0.125 * (static_cast<double>(random.below(5)) - 2.0); };
    const double x = step();
    const double y = step();
    return {x, y, step()};
}

struct Frame {
    Point3 u, v;
};

Frame randomFrame(Random& random) {
    const Matrix3 r = randomRotation(random);
    return {{r[0][0], r[1][0], r[2][0]}, {r[0][1], r[1][1], r[2][1]}};
}

Point3 positionOf(Random& random, Kind kind, const Frame& frame, const std::vector<Point3>& before) {
    switch (kind) {
        case Kind::kCollinear: return random.uniform(-0.5, 0.5) * frame.u;
        case Kind::kCoplanar:
            return random.uniform(-0.4, 0.4) * frame.u + random.uniform(-0.4, 0.4) * frame.v;
        case Kind::kCoincident:
            return random.below(2) == 0 ? before[random.below(before.size())] : inBall(random, 0.4);
        case Kind::kNearTies:
            return random.below(2) == 0 ? before[random.below(before.size())] + inBall(random, 1e-3)
                                        : inBall(random, 0.4);
        case Kind::kAtAnchor:
            // One spot near the anchor a signature: between several that no axis tells apart, which
            // one is matched would be chance.
            if (before.size() == 1) {
                const std::uint64_t which = random.below(3);
                return which == 0 ? Point3{} : inBall(random, which == 1 ? 1e-7 : 0.4);
            }
            return random.below(2) == 0 ? before[1] : inBall(random, 0.4);
        case Kind::kLattice: return latticePoint(random);
        case Kind::kPlain:
        case Kind::kEqualWeight:
        case Kind::kTinyWeight: break;
    }
    return inBall(random, 0.5);
}

float weightOf(Random& random, Kind kind) {
    switch (kind) {
        case Kind::kEqualWeight:
        case Kind::kLattice: return 0.01f;
        case Kind::kNearTies: return 0.01f * (1.0f + static_cast<float>(random.below(3)) * 1.2e-7f);
        case Kind::kTinyWeight: return static_cast<float>(std::pow(10.0, random.uniform(-30, -1)));
        default: return static_cast<float>(0.05 * std::pow(10.0, -2.0 * random.uniform()));
    }
}

void finish(Signature& signature) {
    std::sort(signature.points.begin(), signature.points.end(),
              [](const WeightedPoint& p, const WeightedPoint& q) { return p.weight > q.weight; });
    double whole = 0.0;
    for (const WeightedPoint& p : signature.points) whole += p.weight;
    for (WeightedPoint& p : signature.points) {
        p.volumeShare = std::max(1e-30f, static_cast<float>(p.weight / whole));
        p.maximumRadius = 0.1f;
        p.covariance = {1e-3f, 0, 0, 1e-3f, 0, 1e-3f};
    }
    signature.volume = whole * signature.scale * signature.scale * signature.scale;
}

}  // namespace

Signature randomSignature(Random& random, Kind kind, std::size_t maxPoints) {
    Signature signature;
    signature.scale = std::exp(random.uniform(-3, 3));
    signature.origin = {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
    const std::size_t count = 1 + random.below(maxPoints);
    const Frame frame = randomFrame(random);
    std::vector<float> weights;
    for (std::size_t i = 0; i < count; ++i) weights.push_back(weightOf(random, kind));
    std::sort(weights.rbegin(), weights.rend());
    std::vector<Point3> positions = {Point3{}};
    while (positions.size() < count) positions.push_back(positionOf(random, kind, frame, positions));
    for (std::size_t i = 0; i < count; ++i) {
        WeightedPoint point;
        point.position = {static_cast<float>(positions[i].x), static_cast<float>(positions[i].y),
                          static_cast<float>(positions[i].z)};
        point.weight = weights[i];
        signature.points.push_back(point);
    }
    finish(signature);
    return signature;
}

Signature randomSignature(Random& random, std::size_t maxPoints) {
    return randomSignature(random, static_cast<Kind>(random.below(kKindCount)), maxPoints);
}

Signature disturbed(Signature signature, Random& random, double noise) {
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        WeightedPoint& p = signature.points[i];
        for (float& x : p.position) x = i == 0 ? 0.0f : x + static_cast<float>(noise * random.normal());
        // The heaviest stays the heaviest: it is the anchor.
        const float weight = p.weight * static_cast<float>(std::exp(noise * random.normal()));
        p.weight = i == 0 ? weight : std::min(weight, signature.points.front().weight);
    }
    std::sort(signature.points.begin() + 1, signature.points.end(),
              [](const WeightedPoint& p, const WeightedPoint& q) { return p.weight > q.weight; });
    finish(signature);
    return signature;
}

Signature turned(Signature signature, const Matrix3& rotation) {
    for (WeightedPoint& p : signature.points) {
        const Point3 r = rotate(rotation, {p.position[0], p.position[1], p.position[2]});
        p.position = {static_cast<float>(r.x), static_cast<float>(r.y), static_cast<float>(r.z)};
    }
    return signature;
}

float makeExtreme(Signature& signature, Random& random, double longest) {
    const std::array<double, 5> lengths = {1e-30, 1e-7, 1.0, 1e3, longest};
    const float length = static_cast<float>(lengths[random.below(lengths.size())]);
    const float weight = static_cast<float>(std::pow(10.0, random.uniform(-30, 30)));
    for (WeightedPoint& p : signature.points) {
        for (float& x : p.position) x *= length;
        p.weight *= weight;
    }
    while (!signature.points.empty() && !(signature.points.back().weight > 0.0f)) signature.points.pop_back();
    signature.scale = std::pow(10.0, random.uniform(-40, 40));
    return length;
}

ScoreOptions scoreOptions(bool reflection, bool keepScale, double kernelWidth) {
    ScoreOptions options;
    options.reflection = reflection;
    options.keepScale = keepScale;
    options.kernelWidth = kernelWidth;
    return options;
}

std::array<ScoreOptions, 4> everyOption(double kernelWidth) {
    return {scoreOptions(true, false, kernelWidth), scoreOptions(false, false, kernelWidth),
            scoreOptions(true, true, kernelWidth), scoreOptions(false, true, kernelWidth)};
}

Matrix3 randomReflection(Random& random) {
    Matrix3 r = randomRotation(random);
    for (double& x : r[0]) x = -x;
    return r;
}

Signature signatureOf(const std::vector<std::array<double, 4>>& rows) {
    Signature signature;
    for (const auto& row : rows) {
        WeightedPoint point;
        point.position = {static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2])};
        point.weight = static_cast<float>(row[3]);
        signature.points.push_back(point);
    }
    finish(signature);
    return signature;
}

void expectFiniteScores(const Signature& a, const Signature& b) {
    for (const double width : {kMinKernelWidth, 0.1, kMaxKernelWidth}) {
        for (const ScoreOptions& options : everyOption(width)) {
            const double value = score(a, b, options);
            EXPECT_GE(value, 0.0) << describeSignature(a) << "\n" << describeSignature(b);
            if (a.attributes && b.attributes) {
                EXPECT_GT(value, 0.0);
            }
            EXPECT_LE(value, scoreUpperBound(a, b, options));
            EXPECT_LE(scoreUpperBound(a, b, options), 1.0);
            const Explanation why = explain(a, b, options);
            EXPECT_TRUE(sameBits(why.score, value));
            for (const PointMatch& match : why.matches) {
                EXPECT_TRUE(std::isfinite(match.share) && std::isfinite(match.distance));
            }
        }
    }
}

std::string describeSignature(const Signature& signature) {
    std::ostringstream out;
    out.precision(9);
    out << "scale " << signature.scale << ":";
    for (const WeightedPoint& p : signature.points) {
        out << " {" << p.position[0] << ", " << p.position[1] << ", " << p.position[2] << ", " << p.weight
            << "}";
    }
    return out.str();
}

}  // namespace shapedb::testing_support
