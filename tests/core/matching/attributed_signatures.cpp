// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/matching/attributed_signatures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/synthetic/families.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb::testing_support {

namespace {

std::uint8_t byteNear(double value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

}  // namespace

std::array<float, 6> turnedCovariance(const std::array<float, 6>& c, const Matrix3& r) {
    const Matrix3 own = {{{c[0], c[1], c[2]}, {c[1], c[3], c[4]}, {c[2], c[4], c[5]}}};
    const auto entry = [&](std::size_t i, std::size_t j) {
        double sum = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t l = 0; l < 3; ++l) sum += r[i][k] * own[k][l] * r[j][l];
        }
        return static_cast<float>(sum);
    };
    return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

void updateBody(Signature& signature) { signature.attributes->body = bodyOf(signature.points); }

Signature randomAttributed(Random& random, std::size_t maxPoints) {
    Signature signature = randomSignature(random, maxPoints);
    const bool alike = random.below(3) == 0;  // parts of one size: any may meet any
    for (WeightedPoint& p : signature.points) {
        const auto extent = [&] {
            return alike ? 0.05f : static_cast<float>(0.1 * std::exp(random.normal()));
        };
        const float x = extent(), y = extent(), z = extent();
        p.covariance = turnedCovariance({x * x, 0, 0, y * y, 0, z * z}, randomRotation(random));
        p.maximumRadius = alike ? 0.1f : static_cast<float>(0.1 * std::exp(random.normal()));
    }
    ShapeAttributes& attributes = signature.attributes.emplace();
    attributes.quality = static_cast<std::uint8_t>(random.below(4) == 0 ? 255 : random.below(256));
    for (std::uint8_t& bin : attributes.statistics) {
        bin = random.below(2) == 0 ? 0 : static_cast<std::uint8_t>(random.below(8));
    }
    attributes.earlier = random.below(8) == 0;
    updateBody(signature);
    return signature;
}

Signature disturbedAttributed(Signature signature, Random& random, double noise) {
    double sharesBefore = 0.0;
    double sharesAfter = 0.0;
    for (const WeightedPoint& p : signature.points) sharesBefore += p.volumeShare;
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        WeightedPoint& p = signature.points[i];
        const auto nearly = [&](float x) {
            return x * static_cast<float>(std::exp(noise * random.normal()));
        };
        for (float& x : p.position) x = i == 0 ? 0.0f : x + static_cast<float>(noise * random.normal());
        const float weight = nearly(p.weight);
        p.weight = i == 0 ? weight : std::min(weight, signature.points[i - 1].weight);
        p.volumeShare = nearly(p.volumeShare);
        sharesAfter += p.volumeShare;
        p.maximumRadius = nearly(p.maximumRadius);
        const float wider = nearly(1.0f);
        for (float& c : p.covariance) c *= wider;
    }
    for (WeightedPoint& p : signature.points) {
        p.volumeShare *= static_cast<float>(sharesBefore / sharesAfter);
    }
    for (std::uint8_t& bin : signature.attributes->statistics) {
        if (bin > 0) bin = std::min(kTopLevel, byteNear(bin + 12.0 * noise * random.normal()));
    }
    signature.attributes->quality = byteNear(signature.attributes->quality + 200.0 * noise * random.normal());
    updateBody(signature);
    return signature;
}

Signature turnedAttributed(Signature signature, const Matrix3& rotation) {
    Signature result = turned(std::move(signature), rotation);
    for (WeightedPoint& p : result.points) p.covariance = turnedCovariance(p.covariance, rotation);
    updateBody(result);
    return result;
}

AttributedPair randomAttributedPair(Random& random, double leastNoise, double mostNoise) {
    AttributedPair pair;
    pair.a = randomAttributed(random);
    const double noise = std::pow(10.0, random.uniform(std::log10(leastNoise), std::log10(mostNoise)));
    switch (random.below(4)) {
        case 0: pair.b = disturbedAttributed(pair.a, random, noise); break;
        case 1:
            pair.b = turnedAttributed(disturbedAttributed(pair.a, random, noise), randomRotation(random));
            break;
        case 2:
            pair.b = turnedAttributed(disturbedAttributed(pair.a, random, noise), randomReflection(random));
            break;
        default: pair.b = randomAttributed(random);
    }
    return pair;
}

AttributedPair randomSizedPair(Random& random) {
    AttributedPair pair = randomAttributedPair(random);
    if (random.below(3) == 0) pair.b.scale = pair.a.scale * random.uniform(0.7, 1.4);
    return pair;
}

void forSinglePointPairs(
    const std::function<void(const Signature& a, const Signature& b, const ScoreOptions& options)>& check) {
    Random random(13);
    for (int round = 0; round < 200; ++round) {
        const Signature a = randomAttributed(random, 1);
        const Signature b = randomAttributed(random, 1);
        const Signature c = randomAttributed(random, 5);
        for (const ScoreOptions& options : everyOption()) {
            check(a, b, options);
            check(a, c, options);
        }
    }
}

void expectSoundScore(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const double value = score(a, b, options);
    ASSERT_GT(value, 0.0);
    ASSERT_LE(value, 1.0);
    const bool same = sameShape(a, b) && (!options.keepScale || a.scale == b.scale);
    ASSERT_EQ(value == 1.0, same);
    ASSERT_TRUE(sameBits(value, score(b, a, options)));
    const double bound = scoreUpperBound(a, b, options);
    ASSERT_GE(bound, value);
    ASSERT_LE(bound, 1.0);
    ASSERT_GE(scoreUpperBound(b, a, options), value);
}

namespace {

/// Made once, whichever lists it is in.
const Signature& scanned(std::size_t family, std::size_t member, std::size_t scan) {
    static std::map<std::array<std::size_t, 3>, Signature> made;
    const auto [at, isNew] = made.try_emplace({family, member, scan});
    if (isNew) {
        ScanOptions options;
        options.count = 1600;
        options.noise = 0.002;
        options.seed = 1 + scan + 10 * (member + 10 * family);
        const PointCloud points =
            scanOf(makeMember(listFamilies()[family].name, member, 1).value(), options).value();
        at->second = describe(points, parametersOf(Profile::kDefault)).value().signature;
    }
    return at->second;
}

}  // namespace

const std::vector<Scan>& scannedFamilies(std::size_t members, std::size_t scans) {
    static std::map<std::pair<std::size_t, std::size_t>, std::vector<Scan>> made;
    std::vector<Scan>& all = made[{members, scans}];
    if (!all.empty()) return all;
    for (std::size_t family = 0; family < listFamilies().size(); ++family) {
        for (std::size_t member = 0; member < members; ++member) {
            for (std::size_t scan = 0; scan < scans; ++scan) {
                all.push_back({listFamilies()[family].name, member, scanned(family, member, scan)});
            }
        }
    }
    return all;
}

}  // namespace shapedb::testing_support
