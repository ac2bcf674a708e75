// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/segment_match.h"

#include <algorithm>
#include <cmath>

#include "core/matching/kernel.h"

namespace shapedb {

namespace {

constexpr double kSizeWidth = 0.5;    // octaves: like segments differ by about this in size
constexpr std::size_t kOutlying = 3;  // segments of a that start alignments
constexpr std::size_t kNone = kMaxSignaturePoints;

// Half the sum, over the segments of both sides, of each one's best; gain(i, j) is what a pair is worth.
template <typename Gain>
double bestOfBothSides(std::size_t countA, std::size_t countB, Gain gain) {
    std::array<double, kMaxSignaturePoints> bestOfB{};
    double sum = 0.0;
    for (std::size_t i = 0; i < countA; ++i) {
        double best = 0.0;
        for (std::size_t j = 0; j < countB; ++j) {
            const double g = gain(i, j);
            best = std::max(best, g);
            bestOfB[j] = std::max(bestOfB[j], g);
        }
        sum += best;
    }
    double sumB = 0.0;
    for (std::size_t j = 0; j < countB; ++j) sumB += bestOfB[j];
    return 0.5 * (sum + sumB);
}

// The segments with the most leverage: share times radius.
std::array<std::size_t, kOutlying> outlying(const SegmentSpan& a) {
    std::array<std::size_t, kMaxSignaturePoints> order;
    for (std::size_t i = 0; i < a.size(); ++i) order[i] = i;
    const auto leverage = [&](std::size_t i) { return a[i].share * a[i].radius; };
    std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(a.size()),
              [&](std::size_t x, std::size_t y) {
                  return leverage(x) != leverage(y) ? leverage(x) > leverage(y) : x < y;
              });
    std::array<std::size_t, kOutlying> leaders;
    for (std::size_t n = 0; n < kOutlying; ++n) leaders[n] = n < a.size() ? order[n] : kNone;
    return leaders;
}

}  // namespace

double sizeLikeness(const SegmentDescriptor& p, const SegmentDescriptor& q, double octavesLarger) {
    double squared = 0.0;
    for (std::size_t i = 0; i < p.size.size(); ++i) {
        const double d = static_cast<double>(q.size[i]) - static_cast<double>(p.size[i]) - octavesLarger;
        squared += d * d;
    }
    return kernel(squared / static_cast<double>(p.size.size()), kSizeWidth);
}

class SegmentComparison::Search {
  public:
    Search(const SegmentComparison& pair, bool prune) : pair_(pair), prune_(prune) {}

    // The axes of the frames on each other. Their signs are chance, so all eight are tried.
    void tryFrames() {
        for (int signs = 0; signs < 8; ++signs) {
            const double x = (signs & 1) != 0 ? -1.0 : 1.0;
            const double y = (signs & 2) != 0 ? -1.0 : 1.0;
            const double z = (signs & 4) != 0 ? -1.0 : 1.0;
            tryRotation({{{x, 0, 0}, {0, y, 0}, {0, 0, z}}}, x * y * z < 0.0);
        }
    }

    // Segments j and l of b in the directions of segments i and k of a.
    void tryPairs() {
        const auto leaders = outlying(pair_.a_);
        for (const std::size_t i : leaders) {
            for (const std::size_t k : leaders) {
                if (i == k || i == kNone || k == kNone) continue;
                Tripod to;
                if (!tripod(pair_.positionA_[i], pair_.positionA_[k], to)) continue;
                for (std::size_t j = 0; j < pair_.b_.size(); ++j) {
                    if (!alike(i, j)) continue;
                    for (std::size_t l = 0; l < pair_.b_.size(); ++l) {
                        if (l != j && alike(k, l)) tryTripods(to, j, l);
                    }
                }
            }
        }
    }

    const SegmentMatch& best() const { return best_; }

  private:
    bool alike(std::size_t i, std::size_t j) const {
        // What the pair would be worth if it were equal in size and radius, with the larger share: so unequal
        // shares make segments unlike.
        const double most = 0.5 * static_cast<double>(std::max(pair_.a_[i].share, pair_.b_[j].share));
        return pair_.worth_[i][j] * pair_.radially_[i][j] >= kAlikeEnough * most;
    }

    void tryTripods(const Tripod& to, std::size_t j, std::size_t l) {
        Tripod from;
        if (!tripod(pair_.positionB_[j], pair_.positionB_[l], from)) return;
        tryRotation(tripodMap(from, to, false), false);
        tryRotation(tripodMap(from, to, true), true);
    }

    void tryRotation(const Matrix3& rotation, bool reflected) {
        if (reflected && !pair_.reflection_) return;
        // Only a better one would be taken, and there is none.
        if (prune_ && best_.agreement >= pair_.most_) return;
        const double agreement = pair_.agreementUnder(rotation);
        if (agreement > best_.agreement) best_ = {agreement, rotation, reflected};
    }

    const SegmentComparison& pair_;
    bool prune_;
    SegmentMatch best_;
};

SegmentComparison::SegmentComparison(SegmentSpan a, SegmentSpan b, const ScoreOptions& options)
    : a_(a), b_(b), reflection_(options.reflection), kernelWidth_(options.kernelWidth) {
    const auto place = [](const SegmentDescriptor& p) {
        return Point3{p.position[0], p.position[1], p.position[2]};
    };
    for (std::size_t i = 0; i < a.size(); ++i) positionA_[i] = place(a[i]);
    Row radiusB;
    for (std::size_t j = 0; j < b.size(); ++j) {
        positionB_[j] = place(b[j]);
        radiusB[j] = length(positionB_[j]);
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double radius = length(positionA_[i]);
        for (std::size_t j = 0; j < b.size(); ++j) {
            const double gap = leastGap(radius, radiusB[j]);
            worth_[i][j] =
                0.5 * static_cast<double>(std::min(a[i].share, b[j].share)) * sizeLikeness(a[i], b[j]);
            radially_[i][j] = kernel(gap * gap, kernelWidth_);
        }
    }
    most_ = kBoundMargin * bestOfBothSides(a.size(), b.size(), [&](std::size_t i, std::size_t j) {
                return 2.0 * worth_[i][j] * radially_[i][j];
            });
}

double SegmentComparison::agreementBound() const { return std::min(1.0, most_); }

SegmentComparison::Positions SegmentComparison::rotatedB(const Matrix3& rotation) const {
    Positions result;
    for (std::size_t j = 0; j < b_.size(); ++j) result[j] = rotate(rotation, positionB_[j]);
    return result;
}

double SegmentComparison::gain(std::size_t i, std::size_t j, const Positions& rotated) const {
    return worth_[i][j] *
           (radially_[i][j] + kernel(squaredDistance(positionA_[i], rotated[j]), kernelWidth_));
}

double SegmentComparison::agreementUnder(const Matrix3& rotation) const {
    const Positions rotated = rotatedB(rotation);
    return bestOfBothSides(a_.size(), b_.size(),
                           [&](std::size_t i, std::size_t j) { return gain(i, j, rotated); });
}

SegmentMatch SegmentComparison::match(bool prune) const {
    Search search(*this, prune);
    search.tryFrames();
    search.tryPairs();
    return search.best();
}

SegmentPairs SegmentComparison::pairs(const SegmentMatch& match) const {
    const Positions rotated = rotatedB(match.rotation);
    std::array<Row, kMaxSignaturePoints> gains;
    std::array<std::size_t, kMaxSignaturePoints> bestOfA{}, bestOfB{};
    for (std::size_t i = 0; i < a_.size(); ++i) {
        for (std::size_t j = 0; j < b_.size(); ++j) {
            gains[i][j] = gain(i, j, rotated);
            if (gains[i][j] > gains[i][bestOfA[i]]) bestOfA[i] = j;
            if (gains[i][j] > gains[bestOfB[j]][j]) bestOfB[j] = i;
        }
    }
    SegmentPairs result;
    const auto take = [&](std::size_t i, std::size_t j, double share) {
        if (!(gains[i][j] > 0.0)) return;
        result.pairs[result.count++] = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                        share * gains[i][j], distance(positionA_[i], rotated[j])};
    };
    // Each side counts half: pairs that are best from both sides in full.
    for (std::size_t i = 0; i < a_.size(); ++i) {
        const std::size_t j = bestOfA[i];
        take(i, j, bestOfB[j] == i ? 1.0 : 0.5);
    }
    for (std::size_t j = 0; j < b_.size(); ++j) {
        if (bestOfA[bestOfB[j]] != j) take(bestOfB[j], j, 0.5);
    }
    return result;
}

bool tripod(const Point3& first, const Point3& second, Tripod& out) {
    const double size = length(first);
    if (size < kShortestDirection) return false;
    out[0] = (1.0 / size) * first;
    const Point3 across = second - dot(second, out[0]) * out[0];
    const double off = length(across);
    if (off < kShortestDirection) return false;
    out[1] = (1.0 / off) * across;
    out[2] = cross(out[0], out[1]);
    return true;
}

Matrix3 tripodMap(const Tripod& from, const Tripod& to, bool reflected) {
    const double sign = reflected ? -1.0 : 1.0;
    const auto row = [&](double x, double y, double z) {
        const Point3 r = x * from[0] + y * from[1] + (sign * z) * from[2];
        return std::array<double, 3>{r.x, r.y, r.z};
    };
    return {row(to[0].x, to[1].x, to[2].x), row(to[0].y, to[1].y, to[2].y), row(to[0].z, to[1].z, to[2].z)};
}

}  // namespace shapedb
