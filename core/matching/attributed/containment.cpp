#include "core/matching/attributed/containment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/matching/attributed/tripod.h"
#include "core/matching/published/alignment.h"

namespace shapedb {

namespace {

constexpr std::size_t kLeaders = 3;    // parts of the piece that lead
constexpr double kLargestScale = 1.5;  // a piece is not much larger than its whole
constexpr double kSmallestScale = 1.0 / 16.0;

using Points = std::array<Point3, kMaxSignaturePoints>;

// Octaves by which q is larger than p.
double octaves(const SegmentDescriptor& p, const SegmentDescriptor& q) {
    double sum = 0.0;
    for (std::size_t i = 0; i < p.size.size(); ++i) {
        sum += static_cast<double>(q.size[i]) - static_cast<double>(p.size[i]);
    }
    return sum / static_cast<double>(p.size.size());
}

Point3 placeOf(const SegmentDescriptor& part) {
    return {part.position[0], part.position[1], part.position[2]};
}

double totalShare(const Body& body) {
    double sum = 0.0;
    for (const SegmentDescriptor& part : body.parts) sum += part.share;
    return sum;
}

Points placed(const Body& whole, const Containment& c) {
    Points result;
    for (std::size_t j = 0; j < whole.parts.size(); ++j) {
        result[j] = (1.0 / c.scale) * rotate(c.rotation, placeOf(whole.parts[j]) - c.from) + c.to;
    }
    return result;
}

double pairGain(const SegmentDescriptor& p, const Point3& placedQ, double likeness, double scale,
                double width) {
    // The width is a length of the whole.
    const double gap = squaredDistance(placeOf(p), placedQ) * scale * scale;
    return static_cast<double>(p.share) * kernel(gap, width) * likeness;
}

// How alike each part of the piece and each of the whole are in size, at a scale.
using Likenesses = std::array<std::array<double, kMaxSignaturePoints>, kMaxSignaturePoints>;
Likenesses likenesses(const Body& piece, const Body& whole, double scale) {
    Likenesses table;
    const double larger = std::log2(scale);
    for (std::size_t p = 0; p < piece.parts.size(); ++p) {
        for (std::size_t q = 0; q < whole.parts.size(); ++q) {
            table[p][q] = sizeLikeness(piece.parts[p], whole.parts[q], larger);
        }
    }
    return table;
}

class Search {
  public:
    Search(const Body& piece, const Body& whole, double knownScale, const ScoreOptions& options)
        : piece_(piece),
          whole_(whole),
          knownScale_(knownScale),
          options_(options),
          total_(totalShare(piece)) {}

    Containment run() {
        const std::size_t leaders = std::min(kLeaders, piece_.parts.size());
        for (std::size_t p = 0; p < leaders; ++p) {
            for (std::size_t q = 0; q < whole_.parts.size(); ++q) anchor(p, q, leaders);
        }
        return best_;
    }

  private:
    // SegmentDescriptor p of the piece lies on part q of the whole.
    void anchor(std::size_t p, std::size_t q, std::size_t leaders) {
        Containment trial;
        const double free = octaves(piece_.parts[p], whole_.parts[q]);
        trial.scale =
            knownScale_ > 0.0 ? knownScale_ : std::clamp(std::exp2(free), kSmallestScale, kLargestScale);
        const double larger = std::log2(trial.scale);
        if (sizeLikeness(piece_.parts[p], whole_.parts[q], larger) < kAlikeEnough) return;
        alike_ = likenesses(piece_, whole_, trial.scale);
        boundRests();
        if (hopeless(0.0, 0)) return;
        trial.from = placeOf(whole_.parts[q]);
        trial.to = placeOf(piece_.parts[p]);
        keepBest(trial);
        for (std::size_t i = 0; i < leaders; ++i) {
            for (std::size_t k = 0; k < leaders; ++k) {
                if (i != p && k != p && (i != k || leaders == 2)) turn(trial, q, i, k);
            }
        }
    }

    // Parts i and k of the piece are seen from p as parts j and l of the whole from q.
    void turn(Containment trial, std::size_t q, std::size_t i, std::size_t k) {
        Tripod to;
        const Point3 axis = placeOf(piece_.parts[i]) - trial.to;
        const Point3 side = i == k ? anyAcross(axis) : placeOf(piece_.parts[k]) - trial.to;
        if (!tripod(axis, side, to)) return;
        for (std::size_t j = 0; j < whole_.parts.size(); ++j) {
            if (j == q || !alike(i, j)) continue;
            for (std::size_t l = 0; l < whole_.parts.size(); ++l) {
                if (l == q || l == j || !alike(k, l)) continue;
                Tripod from;
                if (!tripod(placeOf(whole_.parts[j]) - trial.from, placeOf(whole_.parts[l]) - trial.from,
                            from))
                    continue;
                for (const bool reflected : {false, true}) {
                    if (reflected && !options_.reflection) continue;
                    trial.rotation = tripodMap(from, to, reflected);
                    trial.reflected = reflected;
                    keepBest(trial);
                }
            }
        }
    }

    bool alike(std::size_t p, std::size_t q) const { return alike_[p][q] >= kAlikeEnough; }

    // What the parts from each one on can add at most, however the piece is turned: each lies on the
    // part of the whole most like it.
    void boundRests() {
        const std::size_t count = piece_.parts.size();
        rest_[count] = 0.0;
        for (std::size_t p = count; p-- > 0;) {
            double best = 0.0;
            for (std::size_t q = 0; q < whole_.parts.size(); ++q) best = std::max(best, alike_[p][q]);
            rest_[p] = rest_[p + 1] + static_cast<double>(piece_.parts[p].share) * best;
        }
    }

    // Parts before `next` add `sum`: the best so far cannot be beaten. Leaving off there changes nothing.
    bool hopeless(double sum, std::size_t next) const {
        return (sum + rest_[next]) * kBoundMargin <= best_.share * total_;
    }

    void keepBest(Containment& trial) {
        const Points at = placed(whole_, trial);
        double sum = 0.0;
        for (std::size_t i = 0; i < piece_.parts.size(); ++i) {
            double best = 0.0;
            for (std::size_t j = 0; j < whole_.parts.size(); ++j) {
                best = std::max(
                    best, pairGain(piece_.parts[i], at[j], alike_[i][j], trial.scale, options_.kernelWidth));
            }
            sum += best;
            if (hopeless(sum, i + 1)) return;
        }
        trial.share = std::min(1.0, sum / total_);
        if (trial.share > best_.share) best_ = trial;
    }

    const Body& piece_;
    const Body& whole_;
    double knownScale_;
    const ScoreOptions& options_;
    double total_;
    Likenesses alike_{};                                  // at the scale of the present anchor
    std::array<double, kMaxSignaturePoints + 1> rest_{};  // at that scale too
    Containment best_;
};

}  // namespace

Containment containment(const Body& piece, const Body& whole, double knownScale,
                        const ScoreOptions& options) {
    return Search(piece, whole, knownScale, options).run();
}

double containmentBound(const Body& piece, const Body& whole, double knownScale) {
    double sum = 0.0;
    for (const SegmentDescriptor& p : piece.parts) {
        double best = 0.0;
        for (const SegmentDescriptor& q : whole.parts) {
            // Free to choose, the scale that fits a pair best is its mean ratio.
            const double larger = knownScale > 0.0 ? std::log2(knownScale) : octaves(p, q);
            best = std::max(best, sizeLikeness(p, q, larger));
        }
        sum += static_cast<double>(p.share) * best;
    }
    return std::min(1.0, sum / totalShare(piece) * kBoundMargin);
}

SegmentPairs containedPairs(const Body& piece, const Body& whole, const Containment& found,
                            const ScoreOptions& options) {
    SegmentPairs result;
    if (!(found.share > 0.0)) return result;  // nothing was laid on anything
    const Points at = placed(whole, found);
    const Likenesses alike = likenesses(piece, whole, found.scale);
    const double total = totalShare(piece);
    for (std::size_t i = 0; i < piece.parts.size(); ++i) {
        SegmentPair best;
        best.a = static_cast<std::uint8_t>(i);
        for (std::size_t j = 0; j < whole.parts.size(); ++j) {
            const double gain =
                pairGain(piece.parts[i], at[j], alike[i][j], found.scale, options.kernelWidth) / total;
            if (gain <= best.gain) continue;
            best.b = static_cast<std::uint8_t>(j);
            best.gain = gain;
            best.distance = distance(placeOf(piece.parts[i]), at[j]);
        }
        if (best.gain > 0.0) result.pairs[result.count++] = best;
    }
    return result;
}

}  // namespace shapedb
