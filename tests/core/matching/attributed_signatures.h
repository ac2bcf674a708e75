// SPDX-License-Identifier: GPL-3.0-or-later
// Signatures with attributes: random ones with every kind of degeneracy, and those of scans.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/matching/score.h"
#include "core/signature/signature.h"

namespace shapedb::testing_support {

/// 1 to `maxPoints` points (placed and weighted as `randomSignature` does), each with a random
/// extent, and random statistics and quality.
Signature randomAttributed(Random& random, std::size_t maxPoints = 10);

/// The same shape with its points moved a little (by `noise` of the scale) and their sizes and the
/// statistics changed by about as large a share.
Signature disturbedAttributed(Signature signature, Random& random, double noise);

/// In another pose: every position and every extent through a rotation or reflection. Statistics do not
/// depend on the pose.
Signature turnedAttributed(Signature signature, const Matrix3& rotation);

/// A covariance (xx, xy, xz, yy, yz, zz) through a rotation or reflection.
std::array<float, 6> turnedCovariance(const std::array<float, 6>& c, const Matrix3& r);

/// Recomputes the body after the points were changed.
void updateBody(Signature& signature);

struct AttributedPair {
    Signature a, b;
};

/// Unrelated, related (disturbed by `leastNoise` to `mostNoise`) or related in another pose.
AttributedPair randomAttributedPair(Random& random, double leastNoise = 1e-6, double mostNoise = 0.1);

/// `randomAttributedPair`, sometimes also of another size.
AttributedPair randomSizedPair(Random& random);

/// Calls `check` with random pairs of which one or both have a single point, with every option.
void forSinglePointPairs(
    const std::function<void(const Signature& a, const Signature& b, const ScoreOptions& options)>& check);

/// Everything that must hold of the score of a pair, unless partial.
void expectSoundScore(const Signature& a, const Signature& b, const ScoreOptions& options);

struct Scan {
    std::string family;
    std::size_t member = 0;
    Signature signature;
};

/// With the default profile: `members` of each family, `scans` of each member. Cached for each pair of
/// arguments.
const std::vector<Scan>& scannedFamilies(std::size_t members, std::size_t scans);

}  // namespace shapedb::testing_support
