// SPDX-License-Identifier: GPL-3.0-or-later
// Random signatures with every kind of degeneracy, for the tests of matching and search.
#pragma once

#include <array>
#include <cstring>
#include <string>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/matching/score.h"
#include "core/signature/signature.h"

namespace shapedb::testing_support {

/// What is special about a random signature.
enum class Kind {
    kPlain,        ///< positions in a ball, weights over two decades
    kNearTies,     ///< weights equal up to a few units in the last place, points in clusters
    kEqualWeight,  ///< all weights the same
    kCollinear,    ///< all points on a line through the anchor
    kCoplanar,     ///< all points in a plane through the anchor
    kCoincident,   ///< points exactly on each other
    kAtAnchor,     ///< points on the anchor, or 1e-7 from it: too near for a direction
    kTinyWeight,   ///< weights down to 1e-30
    kLattice,      ///< positions on a coarse grid: many equal distances
};
constexpr int kKindCount = 9;

/// 1 to `maxPoints` points by falling weight, anchor first at (0, 0, 0).
Signature randomSignature(Random& random, Kind kind, std::size_t maxPoints);
/// Of a random kind.
Signature randomSignature(Random& random, std::size_t maxPoints = 8);

/// The same shape with every point moved a little (standard deviation `noise` per coordinate)
/// and every weight changed by about as large a share.
Signature disturbed(Signature signature, Random& random, double noise);

/// Every position through a rotation (or reflection), as another pose of the scan would give.
Signature turned(Signature signature, const Matrix3& rotation);

/// The lengths, weights and scale of a signature times numbers far from 1, lengths by up to `longest`; points
/// whose weight then vanishes are dropped, perhaps all. Returns what the lengths were multiplied by.
float makeExtreme(Signature& signature, Random& random, double longest);

ScoreOptions scoreOptions(bool reflection, bool keepScale, double kernelWidth = 0.1);

/// With and without reflection and keepScale.
std::array<ScoreOptions, 4> everyOption(double kernelWidth = 0.1);

inline bool sameBits(double x, double y) { return std::memcmp(&x, &y, sizeof x) == 0; }

/// A random orthonormal matrix of determinant -1.
Matrix3 randomReflection(Random& random);

/// From literal numbers; `rows` are x, y, z, weight.
Signature signatureOf(const std::vector<std::array<double, 4>>& rows);

/// With every option and the least and largest kernel widths, scores, bounds and explanations of a pair of
/// extreme shapes are numbers in their ranges.
void expectFiniteScores(const Signature& a, const Signature& b);

/// The scored numbers, to reproduce a failing pair.
std::string describeSignature(const Signature& signature);

}  // namespace shapedb::testing_support
