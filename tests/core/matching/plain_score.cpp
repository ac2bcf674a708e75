// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/matching/plain_score.h"

#include <algorithm>
#include <cmath>

#include "core/matching/published/published_scorer.h"

namespace shapedb::testing_support {

namespace {

constexpr double kNoDirection = 1e-6;  // as documented in docs/scoring.md

struct Weighted {
    std::vector<Point3> at;
    std::vector<double> weight;
};

Weighted scaledBy(const Signature& signature, double factor) {
    Weighted result;
    for (const WeightedPoint& p : signature.points) {
        result.at.push_back({factor * p.position[0], factor * p.position[1], factor * p.position[2]});
        result.weight.push_back(factor * factor * factor * p.weight);
    }
    return result;
}

double norm(const Point3& p) { return std::hypot(p.x, p.y, p.z); }
Point3 unit(const Point3& p) { return (1.0 / norm(p)) * p; }

Point3 awayFrom(const Point3& axis, const Point3& p) { return p - dot(p, axis) * axis; }

// Columns u, v, u x v.
Matrix3 frameOf(const Point3& u, const Point3& v) {
    const Point3 w = cross(u, v);
    return {{{u.x, v.x, w.x}, {u.y, v.y, w.y}, {u.z, v.z, w.z}}};
}

// to * diag(1, 1, handed) * transposed(from)
Matrix3 between(const Matrix3& to, const Matrix3& from, double handed) {
    Matrix3 r{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            r[i][j] = to[i][0] * from[j][0] + to[i][1] * from[j][1] + handed * to[i][2] * from[j][2];
        }
    }
    return r;
}

Point3 times(const Matrix3& m, const Point3& p) {
    return {m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z, m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z,
            m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z};
}

// Directions across the axis that a point gives; where none does, any direction across.
std::vector<Point3> rollDirections(const std::vector<Point3>& points, const Point3& axis, bool& fixed) {
    std::vector<Point3> directions;
    for (std::size_t p = 1; p < points.size(); ++p) {
        const Point3 across = awayFrom(axis, points[p]);
        if (norm(across) >= kNoDirection) directions.push_back(unit(across));
    }
    fixed = !directions.empty();
    if (!fixed) {
        Point3 across = awayFrom(axis, {1, 0, 0});
        if (norm(across) < 0.1) across = awayFrom(axis, {0, 1, 0});
        directions.push_back(unit(across));
    }
    return directions;
}

double gainOf(const Weighted& a, std::size_t p, const Weighted& b, std::size_t q, const Point3& movedB,
              double width) {
    const double d = norm(a.at[p] - movedB);
    const double share = std::max(0.0, 1.0 - d * d / (8.0 * width * width));
    return std::min(a.weight[p], b.weight[q]) * share * share * share * share;
}

using Gains = std::vector<std::vector<double>>;

// Takes the best remaining pair until there is none; the first by (p, q) of equal ones.
double greedySum(Gains gains) {
    double sum = 0.0;
    while (true) {
        double best = 0.0;
        std::size_t bestP = 0;
        std::size_t bestQ = 0;
        for (std::size_t p = 0; p < gains.size(); ++p) {
            for (std::size_t q = 0; q < gains[p].size(); ++q) {
                if (gains[p][q] > best) {
                    best = gains[p][q];
                    bestP = p;
                    bestQ = q;
                }
            }
        }
        if (best == 0.0) return sum;
        sum += best;
        for (double& gain : gains[bestP]) gain = 0.0;
        for (auto& row : gains) row[bestQ] = 0.0;
    }
}

// Dynamic programme over subsets of b's points.
double optimalSum(const Gains& gains) {
    const std::size_t columns = gains.front().size();
    std::vector<double> best(std::size_t{1} << columns, 0.0);
    for (const auto& row : gains) {
        std::vector<double> next = best;
        for (std::size_t used = 0; used < best.size(); ++used) {
            for (std::size_t q = 0; q < columns; ++q) {
                if ((used >> q & 1u) != 0) continue;
                double& target = next[used | std::size_t{1} << q];
                target = std::max(target, best[used] + row[q]);
            }
        }
        best = next;
    }
    return *std::max_element(best.begin(), best.end());
}

}  // namespace

void forEveryAlignment(const std::vector<Point3>& a, const std::vector<Point3>& b, bool reflection,
                       const std::function<void(const Matrix3&)>& visit) {
    bool any = false;
    for (std::size_t i = 1; i < a.size(); ++i) {
        for (std::size_t j = 1; j < b.size(); ++j) {
            if (norm(a[i]) < kNoDirection || norm(b[j]) < kNoDirection) continue;
            any = true;
            const Point3 axisA = unit(a[i]);
            const Point3 axisB = unit(b[j]);
            bool fixedA = false;
            bool fixedB = false;
            for (const Point3& k : rollDirections(a, axisA, fixedA)) {
                for (const Point3& l : rollDirections(b, axisB, fixedB)) {
                    for (const double handed : {1.0, -1.0}) {
                        if (handed < 0.0 && !reflection) continue;
                        visit(between(frameOf(axisA, k), frameOf(axisB, l), handed));
                    }
                }
            }
        }
    }
    if (!any) visit(Matrix3{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
}

double plainScore(const Signature& a, const Signature& b, const ScoreOptions& options, Matching matching) {
    const double larger = std::max(a.scale, b.scale);
    const Weighted left = scaledBy(a, options.keepScale ? a.scale / larger : 1.0);
    const Weighted right = scaledBy(b, options.keepScale ? b.scale / larger : 1.0);
    double similarity = 0.0;
    forEveryAlignment(left.at, right.at, options.reflection, [&](const Matrix3& rotation) {
        Gains gains(left.at.size(), std::vector<double>(right.at.size()));
        for (std::size_t p = 0; p < left.at.size(); ++p) {
            for (std::size_t q = 0; q < right.at.size(); ++q) {
                gains[p][q] = gainOf(left, p, right, q, times(rotation, right.at[q]), options.kernelWidth);
            }
        }
        similarity =
            std::max(similarity, matching == Matching::kGreedy ? greedySum(gains) : optimalSum(gains));
    });
    double whole = 0.0;
    for (const double weight : left.weight) whole += weight;
    for (const double weight : right.weight) whole += weight;
    const double dissimilarity = whole - 2.0 * similarity;
    const double ratio = similarity / (similarity + dissimilarity);
    const bool single = a.points.size() == 1 || b.points.size() == 1;
    const bool same = sameShape(a, b) && (!options.keepScale || a.scale == b.scale);
    if (same) return 1.0;
    return std::min(ratio, single ? kDegenerateCeiling : 1.0);
}

}  // namespace shapedb::testing_support
