// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/containment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/matching/attributed/segment_match.h"
#include "core/matching/kernel.h"

namespace shapedb {

namespace {

constexpr std::size_t kLeaders = 3;    // segments of the piece that start alignments
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

Point3 placeOf(const SegmentDescriptor& segment) {
    return {segment.position[0], segment.position[1], segment.position[2]};
}

// Less than 1 where the signature leaves out light segments.
double totalShare(const SegmentSpan& body) {
    double sum = 0.0;
    for (const SegmentDescriptor& segment : body) sum += segment.share;
    return sum;
}

Points placed(const SegmentSpan& whole, const Containment& c) {
    Points result;
    for (std::size_t j = 0; j < whole.size(); ++j) {
        result[j] = (1.0 / c.scale) * rotate(c.rotation, placeOf(whole[j]) - c.from) + c.to;
    }
    return result;
}

double pairGain(const SegmentDescriptor& p, const Point3& placedQ, double likeness, double scale,
                double width) {
    // The width is a length of the whole.
    const double gap = squaredDistance(placeOf(p), placedQ) * scale * scale;
    return static_cast<double>(p.share) * kernel(gap, width) * likeness;
}

// How alike each segment of the piece and each of the whole are in size, at a scale.
using Likenesses = std::array<std::array<double, kMaxSignaturePoints>, kMaxSignaturePoints>;
Likenesses likenesses(const SegmentSpan& piece, const SegmentSpan& whole, double scale) {
    Likenesses table;
    const double larger = std::log2(scale);
    for (std::size_t p = 0; p < piece.size(); ++p) {
        for (std::size_t q = 0; q < whole.size(); ++q) {
            table[p][q] = sizeLikeness(piece[p], whole[q], larger);
        }
    }
    return table;
}

class ContainmentSearch {
  public:
    ContainmentSearch(SegmentSpan piece, SegmentSpan whole, double knownScale, const ScoreOptions& options)
        : piece_(piece),
          whole_(whole),
          knownScale_(knownScale),
          options_(options),
          total_(totalShare(piece)) {}

    Containment run() {
        const std::size_t leaders = std::min(kLeaders, piece_.size());
        for (std::size_t p = 0; p < leaders; ++p) {
            for (std::size_t q = 0; q < whole_.size(); ++q) anchor(p, q, leaders);
        }
        return best_;
    }

  private:
    // Segment p of the piece lies on segment q of the whole.
    void anchor(std::size_t p, std::size_t q, std::size_t leaders) {
        Containment trial;
        const double free = octaves(piece_[p], whole_[q]);
        trial.scale =
            knownScale_ > 0.0 ? knownScale_ : std::clamp(std::exp2(free), kSmallestScale, kLargestScale);
        const double larger = std::log2(trial.scale);
        if (sizeLikeness(piece_[p], whole_[q], larger) < kAlikeEnough) return;
        alike_ = likenesses(piece_, whole_, trial.scale);
        boundRests();
        if (hopeless(0.0, 0)) return;
        trial.from = placeOf(whole_[q]);
        trial.to = placeOf(piece_[p]);
        // Not turned: all there is to try for a piece of one segment.
        keepBest(trial);
        for (std::size_t i = 0; i < leaders; ++i) {
            for (std::size_t k = 0; k < leaders; ++k) {
                // With two leaders none is left to show the side: any side will do.
                if (i != p && k != p && (i != k || leaders == 2)) turn(trial, q, i, k);
            }
        }
    }

    // Segments i and k of the piece lie, seen from p, as segments j and l of the whole do, seen from q.
    void turn(Containment trial, std::size_t q, std::size_t i, std::size_t k) {
        Tripod to;
        const Point3 axis = placeOf(piece_[i]) - trial.to;
        const Point3 side = i == k ? anyPerpendicular(axis) : placeOf(piece_[k]) - trial.to;
        if (!tripod(axis, side, to)) return;
        for (std::size_t j = 0; j < whole_.size(); ++j) {
            if (j == q || !alike(i, j)) continue;
            for (std::size_t l = 0; l < whole_.size(); ++l) {
                if (l == q || l == j || !alike(k, l)) continue;
                Tripod from;
                if (!tripod(placeOf(whole_[j]) - trial.from, placeOf(whole_[l]) - trial.from, from)) continue;
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

    // What the segments from each one on can add at most, however the piece is turned: each lies on the
    // segment of the whole that is most like it.
    void boundRests() {
        const std::size_t count = piece_.size();
        rest_[count] = 0.0;
        for (std::size_t p = count; p-- > 0;) {
            double best = 0.0;
            for (std::size_t q = 0; q < whole_.size(); ++q) best = std::max(best, alike_[p][q]);
            rest_[p] = rest_[p + 1] + static_cast<double>(piece_[p].share) * best;
        }
    }

    // The segments before `next` add `sum`, and what follows cannot beat the best so far. Stopping there
    // does not change the result.
    bool hopeless(double sum, std::size_t next) const {
        return (sum + rest_[next]) * kBoundMargin <= best_.share * total_;
    }

    void keepBest(Containment& trial) {
        const Points at = placed(whole_, trial);
        double sum = 0.0;
        for (std::size_t i = 0; i < piece_.size(); ++i) {
            double best = 0.0;
            for (std::size_t j = 0; j < whole_.size(); ++j) {
                best = std::max(best,
                                pairGain(piece_[i], at[j], alike_[i][j], trial.scale, options_.kernelWidth));
            }
            sum += best;
            if (hopeless(sum, i + 1)) return;
        }
        trial.share = std::min(1.0, sum / total_);
        if (trial.share > best_.share) best_ = trial;
    }

    SegmentSpan piece_;
    SegmentSpan whole_;
    double knownScale_;
    const ScoreOptions& options_;
    double total_;
    Likenesses alike_{};                                  // at the scale of the current anchor
    std::array<double, kMaxSignaturePoints + 1> rest_{};  // likewise
    Containment best_;
};

}  // namespace

Containment containment(SegmentSpan piece, SegmentSpan whole, double knownScale,
                        const ScoreOptions& options) {
    return ContainmentSearch(piece, whole, knownScale, options).run();
}

double containmentBound(SegmentSpan piece, SegmentSpan whole, double knownScale) {
    double sum = 0.0;
    for (const SegmentDescriptor& p : piece) {
        double best = 0.0;
        for (const SegmentDescriptor& q : whole) {
            // Where the scale is free, what fits a pair best is its mean ratio.
            const double larger = knownScale > 0.0 ? std::log2(knownScale) : octaves(p, q);
            best = std::max(best, sizeLikeness(p, q, larger));
        }
        sum += static_cast<double>(p.share) * best;
    }
    return std::min(1.0, sum / totalShare(piece) * kBoundMargin);
}

SegmentPairs containedPairs(SegmentSpan piece, SegmentSpan whole, const Containment& found,
                            const ScoreOptions& options) {
    SegmentPairs result;
    if (!(found.share > 0.0)) return result;  // no segment has a counterpart
    const Points at = placed(whole, found);
    const Likenesses alike = likenesses(piece, whole, found.scale);
    const double total = totalShare(piece);
    for (std::size_t i = 0; i < piece.size(); ++i) {
        SegmentPair best;
        best.a = static_cast<std::uint8_t>(i);
        for (std::size_t j = 0; j < whole.size(); ++j) {
            const double gain =
                pairGain(piece[i], at[j], alike[i][j], found.scale, options.kernelWidth) / total;
            if (gain <= best.gain) continue;
            best.b = static_cast<std::uint8_t>(j);
            best.gain = gain;
            best.distance = distance(placeOf(piece[i]), at[j]);
        }
        if (best.gain > 0.0) result.pairs[result.count++] = best;
    }
    return result;
}

}  // namespace shapedb
