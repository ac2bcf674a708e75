// SPDX-License-Identifier: GPL-3.0-or-later
// Why two shapes have the score they have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/motion.h"
#include "core/signature/signature.h"

namespace shapedb {

/// One of the distances that make up the score of signatures with attributes.
struct ScoreTerm {
    const char* name = "";  ///< static storage: "chords", "parts", ...
    double distance = 0.0;  ///< >= 0; 1: typical of unrelated shapes
    double weight = 0.0;    ///< in the mean; the weights of all terms sum to 1
};

struct PointMatch {
    std::uint32_t a = 0;    ///< index into a.points
    std::uint32_t b = 0;    ///< index into b.points
    double share = 0.0;     ///< of the similarity, (0, 1]; all matches sum to 1
    double distance = 0.0;  ///< between the two after the motion, in units of a's scale
};

/// The alignment that gives the score of a against b, and which points it brings together.
struct Explanation {
    double score = 0.0;  ///< as `Scorer::score`, bit for bit
    /// With attributes: how well the parts agree, and what is missing to 1. Without: matched weight, each
    /// pair discounted by its distance; in cubes of the common unit (each signature's own scale, or with
    /// keepScale the larger of the two).
    double similarity = 0.0;
    double dissimilarity = 0.0;  ///< unmatched weight of both sides; same unit
    Motion motion;               ///< scan coordinates of b to scan coordinates of a
    /// In descending order of share; with attributes a point may occur twice.
    std::vector<PointMatch> matches;
    std::vector<ScoreTerm> terms;  ///< with attributes: what the score is made of
    std::vector<std::uint32_t> unmatchedA;
    std::vector<std::uint32_t> unmatchedB;
    bool degenerate = false;  ///< a single-point signature left the rotation open
};

/// Fills in the unmatched points of shapes with `countA` and `countB` points. Scorers end with it.
void listUnmatched(Explanation& explanation, std::size_t countA, std::size_t countB);

/// Replaces the motion, and the distances of the matches by those under it. `a` and `b` are the signatures
/// that the explanation is of.
void setMotion(const Motion& motion, const Signature& a, const Signature& b, Explanation& explanation);

/// The same of b against a, where a length 1 in units of a's scale is `unit` in those of b's.
[[nodiscard]] Explanation exchanged(Explanation explanation, double unit);

}  // namespace shapedb
