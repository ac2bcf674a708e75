#include "core/matching/attributed/segment_match.h"

#include <algorithm>
#include <cmath>

#include "core/matching/attributed/tripod.h"
#include "core/matching/published/alignment.h"

namespace shapedb {

namespace {

// Parts are alike when their four logarithmic sizes differ by about half an octave.
constexpr double kSizeWidth = 0.5;
constexpr std::size_t kOutlying = 3;  // parts of a that lead alignments

using Row = std::array<double, kMaxSignaturePoints>;

// Everything about a pair of bodies that no alignment changes.
struct Table {
    std::size_t countA = 0;
    std::size_t countB = 0;
    std::array<Point3, kMaxSignaturePoints> positionA, positionB;
    std::array<Row, kMaxSignaturePoints> worth;     // min(shares) * likeness of sizes / 2
    std::array<Row, kMaxSignaturePoints> radially;  // kernel of the difference of radii
};

Table tableOf(const Body& a, const Body& b, double width) {
    Table table;
    table.countA = a.parts.size();
    table.countB = b.parts.size();
    const auto place = [](const SegmentDescriptor& p) {
        return Point3{p.position[0], p.position[1], p.position[2]};
    };
    for (std::size_t i = 0; i < table.countA; ++i) table.positionA[i] = place(a.parts[i]);
    for (std::size_t j = 0; j < table.countB; ++j) table.positionB[j] = place(b.parts[j]);
    for (std::size_t i = 0; i < table.countA; ++i) {
        const double radius = length(table.positionA[i]);
        for (std::size_t j = 0; j < table.countB; ++j) {
            const double gap = leastGap(radius, length(table.positionB[j]));
            table.worth[i][j] = 0.5 * static_cast<double>(std::min(a.parts[i].share, b.parts[j].share)) *
                                sizeLikeness(a.parts[i], b.parts[j]);
            table.radially[i][j] = kernel(gap * gap, width);
        }
    }
    return table;
}

// Mean over both sides of each part's best, where gain(i, j) is what a pair is worth.
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

std::array<Point3, kMaxSignaturePoints> turned(const Table& table, const Matrix3& rotation) {
    std::array<Point3, kMaxSignaturePoints> result;
    for (std::size_t j = 0; j < table.countB; ++j) result[j] = rotate(rotation, table.positionB[j]);
    return result;
}

double agreementUnder(const Table& table, const Matrix3& rotation, double width) {
    const auto b = turned(table, rotation);
    return bestOfBothSides(table.countA, table.countB, [&](std::size_t i, std::size_t j) {
        return table.worth[i][j] *
               (table.radially[i][j] + kernel(squaredDistance(table.positionA[i], b[j]), width));
    });
}

class Search {
  public:
    Search(const Table& table, const ScoreOptions& options, double most, bool prune)
        : table_(table), options_(options), most_(most), prune_(prune) {}

    void tryFrames() {
        for (int signs = 0; signs < 8; ++signs) {
            const double x = (signs & 1) != 0 ? -1.0 : 1.0;
            const double y = (signs & 2) != 0 ? -1.0 : 1.0;
            const double z = (signs & 4) != 0 ? -1.0 : 1.0;
            tryRotation({{{x, 0, 0}, {0, y, 0}, {0, 0, z}}}, x * y * z < 0.0);
        }
    }

    // b's parts j and l are laid in the directions of a's parts i and k.
    void tryPairs(const Body& a, const Body& b) {
        const auto leaders = outlying(a);
        for (const std::size_t i : leaders) {
            for (const std::size_t k : leaders) {
                if (i == k || i == kNone || k == kNone) continue;
                Tripod to;
                if (!tripod(table_.positionA[i], table_.positionA[k], to)) continue;
                for (std::size_t j = 0; j < b.parts.size(); ++j) {
                    if (!alike(a, b, i, j)) continue;
                    for (std::size_t l = 0; l < b.parts.size(); ++l) {
                        if (l != j && alike(a, b, k, l)) tryTripods(to, j, l);
                    }
                }
            }
        }
    }

    const SegmentMatch& best() const { return best_; }

  private:
    static constexpr std::size_t kNone = kMaxSignaturePoints;

    // The parts with the most leverage: share times radius.
    std::array<std::size_t, kOutlying> outlying(const Body& a) const {
        std::array<std::size_t, kMaxSignaturePoints> order;
        for (std::size_t i = 0; i < a.parts.size(); ++i) order[i] = i;
        const auto leverage = [&](std::size_t i) { return a.parts[i].share * a.parts[i].radius; };
        std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(a.parts.size()),
                  [&](std::size_t x, std::size_t y) {
                      return leverage(x) != leverage(y) ? leverage(x) > leverage(y) : x < y;
                  });
        std::array<std::size_t, kOutlying> leaders;
        for (std::size_t n = 0; n < kOutlying; ++n) leaders[n] = n < a.parts.size() ? order[n] : kNone;
        return leaders;
    }

    bool alike(const Body& a, const Body& b, std::size_t i, std::size_t j) const {
        const double most = 0.5 * static_cast<double>(std::max(a.parts[i].share, b.parts[j].share));
        return table_.worth[i][j] * table_.radially[i][j] >= kAlikeEnough * most;
    }

    void tryTripods(const Tripod& to, std::size_t j, std::size_t l) {
        Tripod from;
        if (!tripod(table_.positionB[j], table_.positionB[l], from)) return;
        tryRotation(tripodMap(from, to, false), false);
        tryRotation(tripodMap(from, to, true), true);
    }

    void tryRotation(const Matrix3& rotation, bool reflected) {
        if (reflected && !options_.reflection) return;
        if (prune_ && best_.agreement >= most_) return;
        const double agreement = agreementUnder(table_, rotation, options_.kernelWidth);
        if (agreement > best_.agreement) best_ = {agreement, rotation, reflected};
    }

    const Table& table_;
    const ScoreOptions& options_;
    double most_;
    bool prune_;
    SegmentMatch best_;
};

double boundOf(const Table& table) {
    return kBoundMargin * bestOfBothSides(table.countA, table.countB, [&](std::size_t i, std::size_t j) {
               return 2.0 * table.worth[i][j] * table.radially[i][j];
           });
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

SegmentMatch matchSegments(const Body& a, const Body& b, const ScoreOptions& options, bool prune) {
    const Table table = tableOf(a, b, options.kernelWidth);
    Search search(table, options, boundOf(table), prune);
    search.tryFrames();
    search.tryPairs(a, b);
    return search.best();
}

double segmentAgreementBound(const Body& a, const Body& b, const ScoreOptions& options) {
    return std::min(1.0, boundOf(tableOf(a, b, options.kernelWidth)));
}

SegmentPairs segmentPairs(const Body& a, const Body& b, const SegmentMatch& match,
                          const ScoreOptions& options) {
    const Table table = tableOf(a, b, options.kernelWidth);
    const auto placed = turned(table, match.rotation);
    std::array<Row, kMaxSignaturePoints> gain;
    std::array<std::size_t, kMaxSignaturePoints> bestOfA{}, bestOfB{};
    for (std::size_t i = 0; i < table.countA; ++i) {
        for (std::size_t j = 0; j < table.countB; ++j) {
            gain[i][j] = table.worth[i][j] *
                         (table.radially[i][j] +
                          kernel(squaredDistance(table.positionA[i], placed[j]), options.kernelWidth));
            if (gain[i][j] > gain[i][bestOfA[i]]) bestOfA[i] = j;
            if (gain[i][j] > gain[bestOfB[j]][j]) bestOfB[j] = i;
        }
    }
    SegmentPairs result;
    const auto take = [&](std::size_t i, std::size_t j, double share) {
        if (!(gain[i][j] > 0.0)) return;
        result.pairs[result.count++] = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                        share * gain[i][j], distance(table.positionA[i], placed[j])};
    };
    for (std::size_t i = 0; i < table.countA; ++i) {
        const std::size_t j = bestOfA[i];
        take(i, j, bestOfB[j] == i ? 1.0 : 0.5);
    }
    for (std::size_t j = 0; j < table.countB; ++j) {
        if (bestOfA[bestOfB[j]] != j) take(bestOfB[j], j, 0.5);
    }
    return result;
}

}  // namespace shapedb
