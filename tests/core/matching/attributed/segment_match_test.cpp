// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/segment_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::AttributedPair;
using testing_support::randomAttributed;
using testing_support::randomAttributedPair;
using testing_support::randomReflection;
using testing_support::sameBits;
using testing_support::scannedFamilies;
using testing_support::turnedAttributed;

const Body& attributedBody(const Signature& signature) { return signature.attributes->body; }

double shareOf(const Body& body) {
    double sum = 0.0;
    for (const SegmentDescriptor& segment : body.segments) sum += segment.share;
    return sum;
}

ScoreOptions optionsOf(bool reflection, double width) {
    return testing_support::scoreOptions(reflection, false, width);
}

// Four segments of one size without any symmetry.
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

TEST(SegmentMatch, BodyAgreesFullyWithItself) {
    Random random(1);
    for (int round = 0; round < 500; ++round) {
        const Signature a = randomAttributed(random, kMaxSignaturePoints);
        for (const double width : {1e-6, 0.1, 10.0}) {
            for (const bool reflection : {false, true}) {
                const SegmentMatch match =
                    SegmentComparison(attributedBody(a), attributedBody(a), optionsOf(reflection, width))
                        .match();
                EXPECT_NEAR(match.agreement, shareOf(attributedBody(a)), 1e-9);
            }
        }
    }
}

TEST(SegmentMatch, BodyAgreesFullyWithItsRotatedCopy) {
    Random random(2);
    int good = 0;
    constexpr int kRounds = 300;
    for (int round = 0; round < kRounds; ++round) {
        const Signature a = randomAttributed(random);
        const Signature b =
            turnedAttributed(a, round % 2 == 0 ? randomRotation(random) : randomReflection(random));
        const SegmentMatch match =
            SegmentComparison(attributedBody(a), attributedBody(b), optionsOf(true, 0.1)).match();
        good += match.agreement > 0.999 * shareOf(attributedBody(a)) ? 1 : 0;
    }
    // Frames with equal spreads, or too many segments to try all, leave a few. Scans have neither.
    EXPECT_GT(good, kRounds * 95 / 100);
}

TEST(SegmentMatch, RecoversAKnownRotation) {
    const Signature a = chiral();
    Random random(3);
    for (int round = 0; round < 200; ++round) {
        const bool mirrored = round % 2 == 1;
        const Matrix3 turn = mirrored ? randomReflection(random) : randomRotation(random);
        const Signature b = turnedAttributed(a, turn);
        const SegmentMatch match =
            SegmentComparison(attributedBody(a), attributedBody(b), optionsOf(true, 0.1)).match();
        EXPECT_NEAR(match.agreement, shareOf(attributedBody(a)), 1e-4);
        EXPECT_EQ(match.reflected, mirrored);
        EXPECT_NEAR(determinant(match.rotation), mirrored ? -1.0 : 1.0, 1e-9);
        for (std::size_t i = 0; i < a.points.size(); ++i) {
            const auto& p = attributedBody(a).segments[i].position;
            const auto& q = attributedBody(b).segments[i].position;
            EXPECT_LT(distance({p[0], p[1], p[2]}, rotate(match.rotation, {q[0], q[1], q[2]})), 1e-4);
        }
    }
}

TEST(SegmentMatch, TellsLeftFromRightOnlyWithoutReflection) {
    const Signature a = chiral();
    Random random(4);
    for (int round = 0; round < 50; ++round) {
        const Signature b = turnedAttributed(a, randomReflection(random));
        const SegmentMatch with =
            SegmentComparison(attributedBody(a), attributedBody(b), optionsOf(true, 0.05)).match();
        const SegmentMatch without =
            SegmentComparison(attributedBody(a), attributedBody(b), optionsOf(false, 0.05)).match();
        EXPECT_TRUE(with.reflected);
        EXPECT_FALSE(without.reflected);
        EXPECT_LT(without.agreement, with.agreement - 0.02);
    }
}

TEST(SegmentMatch, ReflectionCanOnlyRaiseTheAgreement) {
    Random random(5);
    for (int round = 0; round < 1500; ++round) {
        const AttributedPair pair = randomAttributedPair(random, 1e-5, 0.1);
        const SegmentMatch with =
            SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), optionsOf(true, 0.1)).match();
        const SegmentMatch without =
            SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), optionsOf(false, 0.1)).match();
        EXPECT_GE(with.agreement, without.agreement);
        EXPECT_FALSE(without.reflected);
    }
}

TEST(SegmentMatch, StaysInRangeAndPruningDoesNotChangeIt) {
    Random random(6);
    for (int round = 0; round < 2000; ++round) {
        const AttributedPair pair = randomAttributedPair(random, 1e-5, 0.1);
        const ScoreOptions options =
            optionsOf(round % 2 == 0, round % 3 == 0 ? std::pow(10.0, random.uniform(-3, 1)) : 0.1);
        const SegmentMatch fast =
            SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options).match();
        const SegmentMatch all =
            SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options).match(false);
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

TEST(SegmentMatch, PruningDoesNotChangeTheMatchOfScans) {
    const auto& scans = scannedFamilies(2, 1);
    for (const auto& x : scans) {
        for (const auto& y : scans) {
            const SegmentMatch fast =
                SegmentComparison(attributedBody(x.signature), attributedBody(y.signature), {}).match();
            const SegmentMatch all =
                SegmentComparison(attributedBody(x.signature), attributedBody(y.signature), {}).match(false);
            ASSERT_TRUE(sameBits(fast.agreement, all.agreement));
            ASSERT_EQ(fast.rotation, all.rotation);
        }
    }
}

// For segments of one size, the gain as the header defines it.
TEST(SegmentMatch, AgreementFollowsItsDefinition) {
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
        const Body& x = attributedBody(a);
        const Body& y = attributedBody(b);
        const ScoreOptions options = optionsOf(true, 0.1);
        const SegmentMatch match = SegmentComparison(x, y, options).match();
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
        for (const SegmentDescriptor& p : x.segments) {
            double best = 0.0;
            for (const SegmentDescriptor& q : y.segments) best = std::max(best, gain(p, q));
            sum += best / 2.0;
        }
        for (const SegmentDescriptor& q : y.segments) {
            double best = 0.0;
            for (const SegmentDescriptor& p : x.segments) best = std::max(best, gain(p, q));
            sum += best / 2.0;
        }
        EXPECT_NEAR(match.agreement, sum, 1e-6);
    }
}

TEST(SegmentMatch, IsAtLeastAsGoodAsEveryFrameAlignment) {
    Random random(8);
    for (int round = 0; round < 200; ++round) {
        const AttributedPair pair = randomAttributedPair(random, 1e-5, 0.1);
        const ScoreOptions options = optionsOf(true, 0.1);
        const SegmentMatch match =
            SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options).match();
        for (int signs = 0; signs < 8; ++signs) {
            SegmentMatch frame;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                frame.rotation[axis][axis] = ((signs >> axis) & 1) != 0 ? -1.0 : 1.0;
            }
            const SegmentPairs pairs =
                SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options).pairs(frame);
            double sum = 0.0;
            for (std::size_t i = 0; i < pairs.count; ++i) sum += pairs.pairs[i].gain;
            EXPECT_LE(sum, match.agreement + 1e-12);
        }
    }
}

TEST(SegmentMatch, IsAtLeastAsGoodAsEveryAlignmentOfTheOutlyingSegments) {
    Random random(12);
    int compared = 0;
    for (int round = 0; round < 300; ++round) {
        const Signature a = randomAttributed(random, kMaxSignaturePoints);
        const Signature b = turnedAttributed(a, randomRotation(random));
        const Body& x = attributedBody(a);
        const Body& y = attributedBody(b);
        const ScoreOptions options = optionsOf(false, 0.1);
        const SegmentMatch match = SegmentComparison(x, y, options).match();
        std::vector<std::size_t> order(x.segments.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto leverage = [&](std::size_t i) { return x.segments[i].share * x.segments[i].radius; };
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t i, std::size_t k) { return leverage(i) > leverage(k); });
        const auto at = [](const SegmentDescriptor& s) {
            return Point3{s.position[0], s.position[1], s.position[2]};
        };
        for (std::size_t n = 0; n < std::min<std::size_t>(3, order.size()); ++n) {
            for (std::size_t m = 0; m < std::min<std::size_t>(3, order.size()); ++m) {
                const std::size_t i = order[n];
                const std::size_t k = order[m];
                Tripod to;
                Tripod from;
                if (i == k || !tripod(at(x.segments[i]), at(x.segments[k]), to)) continue;
                if (!tripod(at(y.segments[i]), at(y.segments[k]), from)) continue;
                SegmentMatch aligned;
                aligned.rotation = tripodMap(from, to, false);
                const SegmentPairs pairs = SegmentComparison(x, y, options).pairs(aligned);
                double sum = 0.0;
                for (std::size_t p = 0; p < pairs.count; ++p) sum += pairs.pairs[p].gain;
                EXPECT_LE(sum, match.agreement + 1e-9);
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 500);
}

TEST(SegmentMatch, SegmentsOfDifferentSizesDoNotAgree) {
    Signature a = chiral();
    Signature b = a;
    for (WeightedPoint& p : b.points) {
        for (float& c : p.covariance) c *= 0.001f;
        p.maximumRadius *= 0.03f;
    }
    testing_support::updateBody(b);
    const SegmentMatch match = SegmentComparison(attributedBody(a), attributedBody(b), {}).match();
    EXPECT_EQ(match.agreement, 0.0);
    EXPECT_EQ(SegmentComparison(attributedBody(a), attributedBody(b), {}).pairs(match).count, 0U);
    EXPECT_FALSE(match.reflected);
    // A little thinner is a little less alike.
    double before = SegmentComparison(attributedBody(a), attributedBody(a), {}).match().agreement;
    for (const float factor : {0.8f, 0.6f, 0.4f, 0.2f}) {
        b = a;
        for (WeightedPoint& p : b.points) {
            for (float& c : p.covariance) c *= factor;
        }
        testing_support::updateBody(b);
        const double now = SegmentComparison(attributedBody(a), attributedBody(b), {}).match().agreement;
        EXPECT_LT(now, before) << factor;
        before = now;
    }
}

// A limb that points elsewhere still gets the half for its radius.
TEST(SegmentMatch, BentLimbKeepsHalfItsGain) {
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
    const double same = SegmentComparison(attributedBody(down), attributedBody(down), {}).match().agreement;
    const double bent =
        SegmentComparison(attributedBody(down), attributedBody(up), optionsOf(false, 0.1)).match().agreement;
    const double arm = attributedBody(down).segments.back().share;
    EXPECT_LT(bent, same - 0.2 * arm);
    EXPECT_GT(bent, same - 0.75 * arm - 0.05);
}

TEST(SegmentPairs, GainsSumToTheAgreement) {
    Random random(9);
    for (int round = 0; round < 2000; ++round) {
        const AttributedPair pair = randomAttributedPair(random, 1e-5, 0.1);
        const ScoreOptions options = optionsOf(round % 2 == 0, 0.1);
        const Body& a = attributedBody(pair.a);
        const Body& b = attributedBody(pair.b);
        const SegmentMatch match = SegmentComparison(a, b, options).match();
        const SegmentPairs pairs = SegmentComparison(a, b, options).pairs(match);
        ASSERT_LE(pairs.count, pairs.pairs.size());
        double sum = 0.0;
        std::set<std::pair<int, int>> seen;
        for (std::size_t i = 0; i < pairs.count; ++i) {
            const SegmentPair& p = pairs.pairs[i];
            ASSERT_LT(p.a, a.segments.size());
            ASSERT_LT(p.b, b.segments.size());
            EXPECT_TRUE(seen.insert({p.a, p.b}).second) << "each pair once";
            EXPECT_GT(p.gain, 0.0);
            EXPECT_LE(p.gain, std::min(a.segments[p.a].share, b.segments[p.b].share) * (1.0 + 1e-9));
            const auto& x = a.segments[p.a].position;
            const auto& y = b.segments[p.b].position;
            EXPECT_NEAR(p.distance, distance({x[0], x[1], x[2]}, rotate(match.rotation, {y[0], y[1], y[2]})),
                        1e-9);
            sum += p.gain;
        }
        EXPECT_NEAR(sum, match.agreement, 1e-12);
    }
}

TEST(SegmentAgreementBound, IsNeverBelowTheAgreement) {
    Random random(10);
    double slack = 0.0;
    constexpr int kRounds = 3000;
    for (int round = 0; round < kRounds; ++round) {
        const AttributedPair pair = randomAttributedPair(random, 1e-5, 0.1);
        for (const bool reflection : {false, true}) {
            for (const double width : {0.1, std::pow(10.0, random.uniform(-6, 2))}) {
                const ScoreOptions options = optionsOf(reflection, width);
                const double agreement =
                    SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options)
                        .match()
                        .agreement;
                const double bound =
                    SegmentComparison(attributedBody(pair.a), attributedBody(pair.b), options)
                        .agreementBound();
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
                ASSERT_GE(SegmentComparison(attributedBody(x.signature), attributedBody(y.signature), options)
                              .agreementBound(),
                          std::min(1.0, SegmentComparison(attributedBody(x.signature),
                                                          attributedBody(y.signature), options)
                                            .match()
                                            .agreement));
            }
        }
    }
}

}  // namespace
}  // namespace shapedb
