// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/published/alignment.h"

#include <algorithm>
#include <cmath>

#include "core/matching/kernel.h"

namespace shapedb {

namespace {

// Points nearer to the anchor, or to the axis, than this (in units of the common size) give no direction
// that single precision could be trusted with.
constexpr double kNoDirection = 1e-6;

// Orthonormal, right-handed: u along the axis, e and f across.
struct Axis {
    Point3 u, e, f;
};

Axis axisThrough(const Point3& direction) {
    Axis axis;
    axis.u = (1.0 / length(direction)) * direction;
    // Any vector away from u will do: the coordinate axis it is least aligned with.
    const double x = std::abs(axis.u.x);
    const double y = std::abs(axis.u.y);
    const double z = std::abs(axis.u.z);
    const Point3 other = x <= y && x <= z ? Point3{1, 0, 0} : (y <= z ? Point3{0, 1, 0} : Point3{0, 0, 1});
    const Point3 across = cross(axis.u, other);
    axis.e = (1.0 / length(across)) * across;
    axis.f = cross(axis.u, axis.e);
    return axis;
}

// The points as seen along an axis: height on it and the complex number re + i im across it.
struct Cylindrical {
    std::array<double, kMaxSignaturePoints> height, re, im, squaredRadius;
    bool exists = false;
};

Cylindrical alongAxis(const AnchoredPoints& points, std::size_t through) {
    Cylindrical view;
    if (length(points.position[through]) < kNoDirection) return view;
    const Axis axis = axisThrough(points.position[through]);
    for (std::size_t p = 0; p < points.count; ++p) {
        view.height[p] = dot(points.position[p], axis.u);
        view.re[p] = dot(points.position[p], axis.e);
        view.im[p] = dot(points.position[p], axis.f);
        view.squaredRadius[p] = view.re[p] * view.re[p] + view.im[p] * view.im[p];
    }
    view.exists = true;
    return view;
}

Cylindrical mirrored(Cylindrical view, std::size_t count) {
    for (std::size_t p = 0; p < count; ++p) view.im[p] = -view.im[p];
    return view;
}

// The unit complex number that turns b's point l into the direction of a's point k.
struct Roll {
    double re = 1.0;
    double im = 0.0;
};

bool givesRoll(const Cylindrical& view, std::size_t p) {
    return view.squaredRadius[p] >= kNoDirection * kNoDirection;
}

bool anyRoll(const Cylindrical& view, std::size_t count) {
    for (std::size_t p = 1; p < count; ++p) {
        if (givesRoll(view, p)) return true;
    }
    return false;
}

Roll rollFrom(const Cylindrical& a, std::size_t k, const Cylindrical& b, std::size_t l) {
    // a_k * conj(b_l), normalised; equal numbers give exactly 1.
    const double re = a.re[k] * b.re[l] + a.im[k] * b.im[l];
    const double im = a.im[k] * b.re[l] - a.re[k] * b.im[l];
    const double size = std::sqrt(a.squaredRadius[k] * b.squaredRadius[l]);
    return {re / size, im / size};
}

double squaredGap(const Cylindrical& a, std::size_t p, const Cylindrical& b, std::size_t q,
                  const Roll& roll) {
    const double dh = a.height[p] - b.height[q];
    const double dr = a.re[p] - (roll.re * b.re[q] - roll.im * b.im[q]);
    const double di = a.im[p] - (roll.re * b.im[q] + roll.im * b.re[q]);
    return dh * dh + dr * dr + di * di;
}

// No default values on purpose: the candidates of an alignment live in an array that is not cleared.
struct Candidate {
    double gain;
    double squaredDistance;
    std::uint8_t a, b;
};

// One-to-one matching, greedy by falling gain (equal gains by rising indices). Calls `take` with each
// pair; returns the sum of gains. Where the sum cannot exceed `needed`, returns an upper bound of it
// without matching anything.
template <typename SquaredDistance, typename Take>
double matchGreedily(const AnchoredPoints& a, const AnchoredPoints& b, double width, SquaredDistance between,
                     Take take, double needed = -1.0) {
    std::array<Candidate, kMaxSignaturePoints * kMaxSignaturePoints> candidates;
    std::size_t count = 0;
    double most = 0.0;
    for (std::size_t p = 0; p < a.count; ++p) {
        double bestOfPoint = 0.0;
        for (std::size_t q = 0; q < b.count; ++q) {
            const double squared = between(p, q);
            const double gain = std::min(a.weight[p], b.weight[q]) * kernel(squared, width);
            if (gain > 0.0) {
                candidates[count++] = {gain, squared, static_cast<std::uint8_t>(p),
                                       static_cast<std::uint8_t>(q)};
                bestOfPoint = std::max(bestOfPoint, gain);
            }
        }
        most += bestOfPoint;
    }
    // In a one-to-one matching, no point of a gains more than with its best of b.
    if (most * kBoundMargin <= needed) return most;
    std::sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
              [](const Candidate& x, const Candidate& y) {
                  if (x.gain != y.gain) return x.gain > y.gain;
                  return x.a != y.a ? x.a < y.a : x.b < y.b;
              });
    std::uint32_t usedA = 0;
    std::uint32_t usedB = 0;
    double similarity = 0.0;
    for (std::size_t c = 0; c < count; ++c) {
        const Candidate& pair = candidates[c];
        const std::uint32_t bitA = 1u << pair.a;
        const std::uint32_t bitB = 1u << pair.b;
        if ((usedA & bitA) != 0 || (usedB & bitB) != 0) continue;
        usedA |= bitA;
        usedB |= bitB;
        similarity += pair.gain;
        take(pair);
    }
    return similarity;
}

// An upper bound of the similarity over all rolls about one axis pair: a roll keeps height and radius.
double axisBound(const AnchoredPoints& a, const Cylindrical& viewA, const AnchoredPoints& b,
                 const Cylindrical& viewB, double width) {
    double sum = 0.0;
    std::array<double, kMaxSignaturePoints> radiusB;
    for (std::size_t q = 0; q < b.count; ++q) radiusB[q] = std::sqrt(viewB.squaredRadius[q]);
    for (std::size_t p = 0; p < a.count; ++p) {
        double best = 0.0;
        const double radius = std::sqrt(viewA.squaredRadius[p]);
        for (std::size_t q = 0; q < b.count; ++q) {
            const double dh = leastGap(viewA.height[p], viewB.height[q]);
            const double dr = leastGap(radius, radiusB[q]);
            best = std::max(best, std::min(a.weight[p], b.weight[q]) * kernel(dh * dh + dr * dr, width));
        }
        sum += best;
    }
    return sum * kBoundMargin;
}

class AlignmentSearch {
  public:
    AlignmentSearch(const AnchoredPoints& a, const AnchoredPoints& b, double width, bool prune)
        : a_(a), b_(b), width_(width), prune_(prune) {}

    void tryRolls(Alignment alignment, const Cylindrical& viewA, const Cylindrical& viewB) {
        if (!anyRoll(viewA, a_.count) || !anyRoll(viewB, b_.count)) {
            tryRoll(alignment, viewA, viewB, Roll{});
            return;
        }
        // From 1: the anchor lies on the axis.
        for (std::size_t k = 1; k < a_.count; ++k) {
            if (!givesRoll(viewA, k)) continue;
            for (std::size_t l = 1; l < b_.count; ++l) {
                if (!givesRoll(viewB, l)) continue;
                alignment.k = static_cast<std::uint8_t>(k);
                alignment.l = static_cast<std::uint8_t>(l);
                tryRoll(alignment, viewA, viewB, rollFrom(viewA, k, viewB, l));
            }
        }
    }

    const Alignment& best() const { return best_; }
    double bestSimilarity() const { return bestSimilarity_; }

  private:
    void tryRoll(const Alignment& alignment, const Cylindrical& viewA, const Cylindrical& viewB,
                 const Roll& roll) {
        const auto gap = [&](std::size_t p, std::size_t q) { return squaredGap(viewA, p, viewB, q, roll); };
        const double similarity = matchGreedily(
            a_, b_, width_, gap, [](const Candidate&) {}, prune_ ? bestSimilarity_ : -1.0);
        if (similarity > bestSimilarity_) {
            bestSimilarity_ = similarity;
            best_ = alignment;
        }
    }

    const AnchoredPoints& a_;
    const AnchoredPoints& b_;
    double width_;
    bool prune_;
    Alignment best_;
    double bestSimilarity_ = 0.0;
};

// One axis of either side, and the upper bound over all rolls about them.
struct AxisPair {
    double bound;
    std::uint8_t i, j;
};

// Which points an alignment matches.
PairList matchesOf(const AnchoredPoints& a, const AnchoredPoints& b, double width,
                   const Alignment& alignment) {
    PairList list;
    const auto take = [&](const Candidate& pair) {
        list.pairs[list.count++] = {pair.a, pair.b, pair.gain, pair.squaredDistance};
    };
    if (alignment.i == 0 || alignment.j == 0) {
        // Only the anchors are sure to coincide. What else comes near does so by chance, but counts.
        list.similarity = matchGreedily(
            a, b, width,
            [&](std::size_t p, std::size_t q) { return squaredDistance(a.position[p], b.position[q]); },
            take);
        return list;
    }
    const Cylindrical viewA = alongAxis(a, alignment.i);
    const Cylindrical straightB = alongAxis(b, alignment.j);
    const Cylindrical viewB = alignment.reflected ? mirrored(straightB, b.count) : straightB;
    const Roll roll = alignment.k == 0 ? Roll{} : rollFrom(viewA, alignment.k, viewB, alignment.l);
    list.similarity = matchGreedily(
        a, b, width, [&](std::size_t p, std::size_t q) { return squaredGap(viewA, p, viewB, q, roll); },
        take);
    return list;
}

bool hasAxis(const AnchoredPoints& points) {
    for (std::size_t p = 1; p < points.count; ++p) {
        if (length(points.position[p]) >= kNoDirection) return true;
    }
    return false;
}

}  // namespace

AnchoredPoints anchoredPoints(const ShapeRow& shape, double factor) {
    AnchoredPoints points;
    points.count = shape.pointCount;
    for (std::size_t i = 0; i < points.count; ++i) {
        const PackedPoint& p = shape.points[i];
        points.position[i] = factor * Point3{p.position[0], p.position[1], p.position[2]};
        points.weight[i] = static_cast<double>(p.weight) * factor * factor * factor;
        points.totalWeight += points.weight[i];
    }
    return points;
}

BestAlignment bestAlignment(const AnchoredPoints& a, const AnchoredPoints& b, const ScoreOptions& options,
                            bool prune) {
    if (!hasAxis(a) || !hasAxis(b)) return {{}, matchesOf(a, b, options.kernelWidth, {})};
    AlignmentSearch search(a, b, options.kernelWidth, prune);
    std::array<Cylindrical, kMaxSignaturePoints> viewsA;
    std::array<Cylindrical, kMaxSignaturePoints> viewsB;
    for (std::size_t i = 1; i < a.count; ++i) viewsA[i] = alongAxis(a, i);
    for (std::size_t j = 1; j < b.count; ++j) viewsB[j] = alongAxis(b, j);
    std::array<AxisPair, kMaxSignaturePoints * kMaxSignaturePoints> axes;
    std::size_t count = 0;
    for (std::size_t i = 1; i < a.count; ++i) {
        for (std::size_t j = 1; j < b.count; ++j) {
            if (!viewsA[i].exists || !viewsB[j].exists) continue;
            axes[count++] = {axisBound(a, viewsA[i], b, viewsB[j], options.kernelWidth),
                             static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j)};
        }
    }
    std::sort(axes.begin(), axes.begin() + static_cast<std::ptrdiff_t>(count),
              [](const AxisPair& x, const AxisPair& y) {
                  if (x.bound != y.bound) return x.bound > y.bound;
                  return x.i != y.i ? x.i < y.i : x.j < y.j;
              });
    for (std::size_t c = 0; c < count; ++c) {
        // Bounds fall from here on, and of equal similarities the first wins. The bound holds for the
        // mirrored view as well, whose heights and radii are the same.
        if (prune && axes[c].bound <= search.bestSimilarity()) break;
        Alignment alignment;
        alignment.i = axes[c].i;
        alignment.j = axes[c].j;
        search.tryRolls(alignment, viewsA[alignment.i], viewsB[alignment.j]);
        if (!options.reflection) continue;
        alignment.reflected = true;
        search.tryRolls(alignment, viewsA[alignment.i], mirrored(viewsB[alignment.j], b.count));
    }
    return {search.best(), matchesOf(a, b, options.kernelWidth, search.best())};
}

Matrix3 alignmentRotation(const AnchoredPoints& a, const AnchoredPoints& b, const Alignment& alignment) {
    if (alignment.i == 0 || alignment.j == 0) return Motion{}.rotation;
    const Axis axisA = axisThrough(a.position[alignment.i]);
    const Axis axisB = axisThrough(b.position[alignment.j]);
    Roll roll;
    if (alignment.k != 0) {
        const Cylindrical viewA = alongAxis(a, alignment.i);
        Cylindrical viewB = alongAxis(b, alignment.j);
        if (alignment.reflected) viewB = mirrored(viewB, b.count);
        roll = rollFrom(viewA, alignment.k, viewB, alignment.l);
    }
    // b's coordinates (height, re, im) -> rolled -> along a's axes. Mirroring negates im first.
    const double mirror = alignment.reflected ? -1.0 : 1.0;
    const Point3 imageOfE = roll.re * axisA.e + roll.im * axisA.f;
    const Point3 imageOfF = mirror * (roll.re * axisA.f - roll.im * axisA.e);
    const auto row = [&](double u, double e, double f) {
        const Point3 r = u * axisB.u + e * axisB.e + f * axisB.f;
        return std::array<double, 3>{r.x, r.y, r.z};
    };
    return {row(axisA.u.x, imageOfE.x, imageOfF.x), row(axisA.u.y, imageOfE.y, imageOfF.y),
            row(axisA.u.z, imageOfE.z, imageOfF.z)};
}

}  // namespace shapedb
