#include "core/matching/attributed/segment_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iostream>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "core/matching/published/alignment.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::disturbedAttributed;
using testing_support::randomAttributed;
using testing_support::randomReflection;
using testing_support::scannedFamilies;
using testing_support::turnedAttributed;

bool sameBits(double x, double y) { return std::memcmp(&x, &y, sizeof x) == 0; }

const Body& bodyOf(const Signature& signature) { return signature.attributes->body; }

double shareOf(const Body& body) {
    double sum = 0.0;
    for (const SegmentDescriptor& part : body.parts) sum += part.share;
    return sum;
}

ScoreOptions optionsOf(bool reflection, double width) {
    return testing_support::scoreOptions(reflection, false, width);
}

struct Pair {
    Signature a, b;
};

Pair randomPair(Random& random) {
    Pair pair;
    pair.a = randomAttributed(random);
    const double noise = std::pow(10.0, random.uniform(-5, -1));
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

// Four parts of one size that no motion but the identity lays on themselves.
Signature chiral() {
    Signature signature = testing_support::signatureOf(
        {{0, 0, 0, 0.05}, {0.45, 0, 0, 0.021}, {0, 0.3, 0, 0.02}, {0.1, 0, 0.25, 0.019}});
    for (WeightedPoint& p : signature.points) {
        p.covariance = {0.01f, 0, 0, 0.01f, 0, 0.01f};
    }
    signature.attributes.emplace();
    testing_support::updateBody(signature);
    return signature;
}

TEST(SegmentMatch, OfABodyWithItselfIsAllOfIt) {
    Random random(1);
    for (int round = 0; round < 500; ++round) {
        const Signature a = randomAttributed(random, kMaxSignaturePoints);
        for (const double width : {1e-6, 0.1, 10.0}) {
            for (const bool reflection : {false, true}) {
                const SegmentMatch match = matchSegments(bodyOf(a), bodyOf(a), optionsOf(reflection, width));
                EXPECT_NEAR(match.agreement, shareOf(bodyOf(a)), 1e-9);
            }
        }
    }
}

TEST(SegmentMatch, OfABodyInAnotherPoseIsAllOfIt) {
    Random random(2);
    int good = 0;
    constexpr int kRounds = 300;
    for (int round = 0; round < kRounds; ++round) {
        const Signature a = randomAttributed(random);
        const Signature b =
            turnedAttributed(a, round % 2 == 0 ? randomRotation(random) : randomReflection(random));
        const SegmentMatch match = matchSegments(bodyOf(a), bodyOf(b), optionsOf(true, 0.1));
        good += match.agreement > 0.999 * shareOf(bodyOf(a)) ? 1 : 0;
    }
    // Frames of equal spread and parts too many to try leave a few; scans have neither.
    EXPECT_GT(good, kRounds * 95 / 100);
}

TEST(SegmentMatch, RecoversAKnownTurn) {
    const Signature a = chiral();
    Random random(3);
    for (int round = 0; round < 200; ++round) {
        const bool mirrored = round % 2 == 1;
        const Matrix3 turn = mirrored ? randomReflection(random) : randomRotation(random);
        const Signature b = turnedAttributed(a, turn);
        const SegmentMatch match = matchSegments(bodyOf(a), bodyOf(b), optionsOf(true, 0.1));
        EXPECT_NEAR(match.agreement, shareOf(bodyOf(a)), 1e-4);
        EXPECT_EQ(match.reflected, mirrored);
        EXPECT_NEAR(determinant(match.rotation), mirrored ? -1.0 : 1.0, 1e-9);
        for (std::size_t i = 0; i < a.points.size(); ++i) {
            const auto& p = bodyOf(a).parts[i].position;
            const auto& q = bodyOf(b).parts[i].position;
            EXPECT_LT(distance({p[0], p[1], p[2]}, rotate(match.rotation, {q[0], q[1], q[2]})), 1e-4);
        }
    }
}

TEST(SegmentMatch, TellsLeftFromRightOnlyWithoutReflection) {
    const Signature a = chiral();
    Random random(4);
    for (int round = 0; round < 50; ++round) {
        const Signature b = turnedAttributed(a, randomReflection(random));
        const SegmentMatch with = matchSegments(bodyOf(a), bodyOf(b), optionsOf(true, 0.05));
        const SegmentMatch without = matchSegments(bodyOf(a), bodyOf(b), optionsOf(false, 0.05));
        EXPECT_TRUE(with.reflected);
        EXPECT_FALSE(without.reflected);
        EXPECT_LT(without.agreement, with.agreement - 0.02);
    }
}

TEST(SegmentMatch, ReflectionCanOnlyRaiseIt) {
    Random random(5);
    for (int round = 0; round < 1500; ++round) {
        const Pair pair = randomPair(random);
        const SegmentMatch with = matchSegments(bodyOf(pair.a), bodyOf(pair.b), optionsOf(true, 0.1));
        const SegmentMatch without = matchSegments(bodyOf(pair.a), bodyOf(pair.b), optionsOf(false, 0.1));
        EXPECT_GE(with.agreement, without.agreement);
        EXPECT_FALSE(without.reflected);
    }
}

TEST(SegmentMatch, StaysInItsRangeAndPruningChangesNoBit) {
    Random random(6);
    for (int round = 0; round < 2000; ++round) {
        const Pair pair = randomPair(random);
        const ScoreOptions options =
            optionsOf(round % 2 == 0, round % 3 == 0 ? std::pow(10.0, random.uniform(-3, 1)) : 0.1);
        const SegmentMatch fast = matchSegments(bodyOf(pair.a), bodyOf(pair.b), options);
        const SegmentMatch all = matchSegments(bodyOf(pair.a), bodyOf(pair.b), options, false);
        EXPECT_TRUE(sameBits(fast.agreement, all.agreement));
        EXPECT_EQ(fast.rotation, all.rotation);
        EXPECT_EQ(fast.reflected, all.reflected);
        EXPECT_GE(fast.agreement, 0.0);
        EXPECT_LE(fast.agreement, 1.0 + 16.0 / 65535.0) << "the least shares are rounded up";
        EXPECT_NEAR(determinant(fast.rotation), fast.reflected ? -1.0 : 1.0, 1e-9);
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                const auto& r = fast.rotation;
                EXPECT_NEAR(r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2], i == j ? 1 : 0, 1e-9);
            }
        }
    }
}

TEST(SegmentMatch, ScansPrunedAndNotAreTheSame) {
    const auto& scans = scannedFamilies(2, 1);
    for (const auto& x : scans) {
        for (const auto& y : scans) {
            const SegmentMatch fast = matchSegments(bodyOf(x.signature), bodyOf(y.signature), {});
            const SegmentMatch all = matchSegments(bodyOf(x.signature), bodyOf(y.signature), {}, false);
            ASSERT_TRUE(sameBits(fast.agreement, all.agreement));
            ASSERT_EQ(fast.rotation, all.rotation);
        }
    }
}

// What no alignment changes is decided once: with parts of one size the gain is as the header says.
TEST(SegmentMatch, GainsAreTheirDefinition) {
    Random random(7);
    for (int round = 0; round < 300; ++round) {
        Signature a = randomAttributed(random);
        Signature b = randomAttributed(random);
        for (Signature* s : {&a, &b}) {
            for (WeightedPoint& p : s->points) {
                p.covariance = {0.01f, 0, 0, 0.01f, 0, 0.01f};
                p.maximumRadius = 0.1f;
            }
            testing_support::updateBody(*s);
        }
        const Body& x = bodyOf(a);
        const Body& y = bodyOf(b);
        const ScoreOptions options = optionsOf(true, 0.1);
        const SegmentMatch match = matchSegments(x, y, options);
        const auto gain = [&](const SegmentDescriptor& p, const SegmentDescriptor& q) {
            const Point3 at{p.position[0], p.position[1], p.position[2]};
            const Point3 there = rotate(match.rotation, {q.position[0], q.position[1], q.position[2]});
            const double apart = distance(at, there);
            const double radii = length(at) - length(there);
            const auto k = [](double d) {
                const double t = 1.0 - d * d / (8.0 * 0.1 * 0.1);
                return t > 0.0 ? std::pow(t, 4.0) : 0.0;
            };
            return std::min(p.share, q.share) * (k(radii) + k(apart)) / 2.0;
        };
        double sum = 0.0;
        for (const SegmentDescriptor& p : x.parts) {
            double best = 0.0;
            for (const SegmentDescriptor& q : y.parts) best = std::max(best, gain(p, q));
            sum += best / 2.0;
        }
        for (const SegmentDescriptor& q : y.parts) {
            double best = 0.0;
            for (const SegmentDescriptor& p : x.parts) best = std::max(best, gain(p, q));
            sum += best / 2.0;
        }
        EXPECT_NEAR(match.agreement, sum, 1e-6);
    }
}

// Of each part's counterparts: no turn can be better than the bound, few are better than the match.
TEST(SegmentMatch, IsAtLeastAsGoodAsTheFrames) {
    Random random(8);
    for (int round = 0; round < 200; ++round) {
        const Pair pair = randomPair(random);
        const ScoreOptions options = optionsOf(true, 0.1);
        const SegmentMatch match = matchSegments(bodyOf(pair.a), bodyOf(pair.b), options);
        for (int signs = 0; signs < 8; ++signs) {
            SegmentMatch frame;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                frame.rotation[axis][axis] = ((signs >> axis) & 1) != 0 ? -1.0 : 1.0;
            }
            const SegmentPairs pairs = segmentPairs(bodyOf(pair.a), bodyOf(pair.b), frame, options);
            double sum = 0.0;
            for (std::size_t i = 0; i < pairs.count; ++i) sum += pairs.pairs[i].gain;
            EXPECT_LE(sum, match.agreement + 1e-12);
        }
    }
}

TEST(SegmentMatch, UnlikePartsDoNotAgree) {
    Signature a = chiral();
    Signature b = a;
    for (WeightedPoint& p : b.points) {
        for (float& c : p.covariance) c *= 0.001f;
        p.maximumRadius *= 0.03f;
    }
    testing_support::updateBody(b);
    const SegmentMatch match = matchSegments(bodyOf(a), bodyOf(b), {});
    EXPECT_EQ(match.agreement, 0.0);
    EXPECT_EQ(segmentPairs(bodyOf(a), bodyOf(b), match, {}).count, 0U);
    EXPECT_FALSE(match.reflected);
    // A little thinner is a little less alike.
    double before = matchSegments(bodyOf(a), bodyOf(a), {}).agreement;
    for (const float factor : {0.8f, 0.6f, 0.4f, 0.2f}) {
        b = a;
        for (WeightedPoint& p : b.points) {
            for (float& c : p.covariance) c *= factor;
        }
        testing_support::updateBody(b);
        const double now = matchSegments(bodyOf(a), bodyOf(b), {}).agreement;
        EXPECT_LT(now, before) << factor;
        before = now;
    }
}

// A limb that points elsewhere still earns the half that its radius is due.
TEST(SegmentMatch, PoseIsHalfTheGain) {
    const auto withArm = [](double angle) {
        Signature s = testing_support::signatureOf({{0, 0, 0, 0.9},
                                                    {0.5, 0, 0, 0.03},
                                                    {0, 0.45, 0, 0.03},
                                                    {0.4 * std::cos(angle), 0, 0.4 * std::sin(angle), 0.03}});
        s.attributes.emplace();
        testing_support::updateBody(s);
        return s;
    };
    const Signature down = withArm(1.5707963);
    const Signature up = withArm(-2.5);
    const double same = matchSegments(bodyOf(down), bodyOf(down), {}).agreement;
    const double bent = matchSegments(bodyOf(down), bodyOf(up), optionsOf(false, 0.1)).agreement;
    const double arm = bodyOf(down).parts.back().share;
    EXPECT_LT(bent, same - 0.2 * arm);
    EXPECT_GT(bent, same - 0.75 * arm - 0.05);
}

TEST(SegmentPairs, GainsSumToTheAgreement) {
    Random random(9);
    for (int round = 0; round < 2000; ++round) {
        const Pair pair = randomPair(random);
        const ScoreOptions options = optionsOf(round % 2 == 0, 0.1);
        const Body& a = bodyOf(pair.a);
        const Body& b = bodyOf(pair.b);
        const SegmentMatch match = matchSegments(a, b, options);
        const SegmentPairs pairs = segmentPairs(a, b, match, options);
        ASSERT_LE(pairs.count, pairs.pairs.size());
        double sum = 0.0;
        std::set<std::pair<int, int>> seen;
        for (std::size_t i = 0; i < pairs.count; ++i) {
            const SegmentPair& p = pairs.pairs[i];
            ASSERT_LT(p.a, a.parts.size());
            ASSERT_LT(p.b, b.parts.size());
            EXPECT_TRUE(seen.insert({p.a, p.b}).second) << "each pair once";
            EXPECT_GT(p.gain, 0.0);
            EXPECT_LE(p.gain, std::min(a.parts[p.a].share, b.parts[p.b].share) * (1.0 + 1e-9));
            const auto& x = a.parts[p.a].position;
            const auto& y = b.parts[p.b].position;
            EXPECT_NEAR(p.distance, distance({x[0], x[1], x[2]}, rotate(match.rotation, {y[0], y[1], y[2]})),
                        1e-9);
            sum += p.gain;
        }
        EXPECT_NEAR(sum, match.agreement, 1e-12);
    }
}

TEST(PartAgreementBound, IsNeverBelowTheAgreement) {
    Random random(10);
    double slack = 0.0;
    constexpr int kRounds = 3000;
    for (int round = 0; round < kRounds; ++round) {
        const Pair pair = randomPair(random);
        for (const bool reflection : {false, true}) {
            for (const double width : {0.1, std::pow(10.0, random.uniform(-6, 2))}) {
                const ScoreOptions options = optionsOf(reflection, width);
                const double agreement = matchSegments(bodyOf(pair.a), bodyOf(pair.b), options).agreement;
                const double bound = segmentAgreementBound(bodyOf(pair.a), bodyOf(pair.b), options);
                ASSERT_GE(bound, std::min(1.0, agreement)) << "width " << width;
                ASSERT_LE(bound, 1.0);
                if (width == 0.1 && reflection) slack += (bound - agreement) / kRounds;
            }
        }
    }
    std::cout << "bound over agreement of random bodies: mean " << slack << "\n";
    const auto& scans = scannedFamilies(2, 1);
    for (const auto& x : scans) {
        for (const auto& y : scans) {
            for (const double width : {0.02, 0.1, 0.5}) {
                const ScoreOptions options = optionsOf(false, width);
                ASSERT_GE(
                    segmentAgreementBound(bodyOf(x.signature), bodyOf(y.signature), options),
                    std::min(1.0,
                             matchSegments(bodyOf(x.signature), bodyOf(y.signature), options).agreement));
            }
        }
    }
}

}  // namespace
}  // namespace shapedb
