#include "core/matching/attributed/attribute_score.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace shapedb {

namespace {

// What two unrelated shapes differ by (median over pairs of different synthetic families): it
// gives every term an equal say, whatever the number of its bins.
constexpr std::array<double, kStatisticKinds> kTypical{2.17, 3.24, 3.93, 1.10, 4.62,
                                                       1.27, 4.20, 1.69, 2.95, 0.76};
constexpr double kTypicalDisagreement = 0.9;

// How much a statistic counts where the interior is told, and where it is a guess: the scan then
// shows one side of the surface, or thin parts in noise. Two sides of a surface and one of them have
// the same outline as they lie, and nearly the same distances.
struct EvidenceWeight {
    double reliable;
    double unreliable;
};
constexpr EvidenceWeight weightOf(Evidence evidence) {
    switch (evidence) {
        case Evidence::kInside: return {1.0, 0.01};
        case Evidence::kSurface: return {1.0, 0.5};
        case Evidence::kOutline: return {0.5, 1.0};
    }
    return {1.0, 1.0};
}

// Of a piece, what its whole contains of it against what the two look like: segments of a guess are
// cut otherwise than those of the whole.
constexpr EvidenceWeight kContainedWeight{0.5, 0.25};

// Parts say both which parts there are and where they lie: two of the statistics' worth.
constexpr double kPartsWeight = 2.0;

// The distance, in units of what unrelated shapes differ by, at which a score has fallen to 0.5.
constexpr double kHalfWay = 0.5;

double scoreOf(double distance) {
    const double d = distance / kHalfWay;
    return 1.0 / (1.0 + d * d);
}

// An interior of this quality is trusted in full. Below it is a guess, and trust falls fast: a
// thickness off by half spoils its histograms altogether.
constexpr double kTrustedQuality = 0.5;

double trust(std::uint8_t qualityA, std::uint8_t qualityB) {
    const double worse = std::min(qualityA, qualityB) / 255.0;
    const double share = std::min(1.0, worse / kTrustedQuality);
    return share * share * share * share;
}

double trust(const Signature& a, const Signature& b) {
    return trust(a.attributes->quality, b.attributes->quality);
}

int difference(const std::uint8_t* x, const std::uint8_t* y, std::size_t count) {
    int sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += std::abs(static_cast<int>(x[i]) - static_cast<int>(y[i]));
    return sum;
}

double termDistance(const Signature& a, const Signature& b, std::size_t kind) {
    const StatisticLayout& layout = kStatistics[kind];
    const std::uint8_t* x = a.attributes->statistics.data() + layout.offset;
    const std::uint8_t* y = b.attributes->statistics.data() + layout.offset;
    int sum = difference(x, y, layout.count);
    if (layout.reversibleRows > 0) {
        const std::size_t columns = layout.count / layout.reversibleRows;
        int reversed = 0;
        for (std::size_t from = 0; from < layout.count; from += columns) {
            reversed += difference(x + from, y + (layout.count - columns - from), columns);
        }
        sum = std::min(sum, reversed);
    }
    return sum * kRootPerLevel / kTypical[kind];
}

double between(const EvidenceWeight& weight, double trust) {
    return trust * weight.reliable + (1.0 - trust) * weight.unreliable;
}

double termWeight(std::size_t kind, double trust) {
    return between(weightOf(kStatistics[kind].evidence), trust);
}

double scaleDistance(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return options.keepScale ? octavesBetween(a.scale, b.scale) : 0.0;
}

double disagreement(double agreement) { return std::max(0.0, 1.0 - agreement) / kTypicalDisagreement; }

double meanDistance(const AttributeDistance& distance, double agreement) {
    return (distance.statistics + distance.partsWeight * disagreement(agreement)) / distance.totalWeight;
}

}  // namespace

AttributeDistance attributeDistance(const Signature& a, const Signature& b, const ScoreOptions& options) {
    AttributeDistance result;
    const double interior = trust(a, b);
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        const double weight = termWeight(kind, interior);
        result.statistics += weight * termDistance(a, b, kind);
        result.totalWeight += weight;
    }
    result.partsWeight = kPartsWeight * between(weightOf(Evidence::kInside), interior);
    result.totalWeight += result.partsWeight;
    result.containedWeight = between(kContainedWeight, interior);
    result.scale = scaleDistance(a, b, options);
    return result;
}

double attributeScore(const AttributeDistance& distance, double agreement) {
    return scoreOf(std::hypot(meanDistance(distance, agreement), distance.scale));
}

double pieceScore(const AttributeDistance& distance, double agreement, double share) {
    return scoreOf((1.0 - distance.containedWeight) * meanDistance(distance, agreement) +
                   distance.containedWeight * disagreement(share));
}

LevelWeights levelWeights(std::uint8_t qualityA, std::uint8_t qualityB) {
    const double interior = trust(qualityA, qualityB);
    LevelWeights weights;
    double total = kPartsWeight * between(weightOf(Evidence::kInside), interior);
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        weights.perLevel[kind] = termWeight(kind, interior) * kRootPerLevel / kTypical[kind];
        total += termWeight(kind, interior);
    }
    for (double& weight : weights.perLevel) weight /= total;
    weights.partial = 1.0 - between(kContainedWeight, interior);
    return weights;
}

double maxDistanceForScore(double score) {
    // Near 1 a difference of rounding in the score is one of 1e-8 in the distance.
    return score > 0.0 ? kHalfWay * std::sqrt(std::max(0.0, 1.0 / score - 1.0)) * (1.0 + 1e-9) + 1e-7
                       : INFINITY;
}

double scoreAt(double distance) {
    // Distance 0 may be a shape itself.
    return distance > 0.0 ? std::min(1.0, scoreOf(distance) * (1.0 + 1e-9)) : 1.0;
}

double octavesBetween(double scaleA, double scaleB) {
    return std::abs(std::log2(std::max(scaleA, scaleB) / std::min(scaleA, scaleB)));
}

std::vector<ScoreTerm> scoreTerms(const Signature& a, const Signature& b, const ScoreOptions& options,
                                  double agreement) {
    const AttributeDistance distance = attributeDistance(a, b, options);
    const double interior = trust(a, b);
    std::vector<ScoreTerm> terms;
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        terms.push_back({kStatistics[kind].name, termDistance(a, b, kind),
                         termWeight(kind, interior) / distance.totalWeight});
    }
    terms.push_back({"parts", disagreement(agreement), distance.partsWeight / distance.totalWeight});
    return terms;
}

std::vector<ScoreTerm> pieceTerms(const Signature& a, const Signature& b, const ScoreOptions& options,
                                  double agreement, double share) {
    std::vector<ScoreTerm> terms = scoreTerms(a, b, options, agreement);
    const double contained = between(kContainedWeight, trust(a, b));
    for (ScoreTerm& term : terms) term.weight *= 1.0 - contained;
    terms.push_back({"contained parts", disagreement(share), contained});
    return terms;
}

}  // namespace shapedb
