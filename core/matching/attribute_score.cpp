#include "core/matching/attribute_score.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace shapedb {

namespace {

// What two unrelated shapes differ by (median over pairs of different synthetic families): it
// gives every term an equal say, whatever the number of its bins.
constexpr std::array<double, kStatisticKinds> kTypical{2.17, 3.24, 3.93, 1.10, 4.62, 1.27, 4.20};
constexpr double kTypicalDisagreement = 0.9;

// Of a piece, what its whole contains of it against what the two look like.
constexpr double kContainedWeight = 0.5;

// Parts say both which parts there are and where they lie: two of the statistics' worth.
constexpr double kPartsWeight = 2.0;

// An interior that could not be told still says something.
constexpr double kLeastTrust = 0.01;

constexpr double kBinsPerUnit = 255.0;

// The distance, in units of what unrelated shapes differ by, at which a score has fallen to 0.5.
constexpr double kHalfWay = 0.5;

double scoreOf(double distance) {
    const double d = distance / kHalfWay;
    return 1.0 / (1.0 + d * d);
}

// An interior of this quality is trusted in full. Below it is a guess, and trust falls fast: a
// thickness off by half spoils its histograms altogether.
constexpr double kTrustedQuality = 0.5;

double trust(const Signature& a, const Signature& b) {
    const double worse = std::min(a.attributes->quality, b.attributes->quality) / 255.0;
    const double share = std::min(1.0, worse / kTrustedQuality);
    return std::max(kLeastTrust, share * share * share * share);
}

double termDistance(const Signature& a, const Signature& b, std::size_t kind) {
    const StatisticLayout& layout = kStatistics[kind];
    const std::uint8_t* x = a.attributes->statistics.data() + layout.offset;
    const std::uint8_t* y = b.attributes->statistics.data() + layout.offset;
    int sum = 0;
    for (std::size_t i = 0; i < layout.count; ++i)
        sum += std::abs(static_cast<int>(x[i]) - static_cast<int>(y[i]));
    return sum / (kBinsPerUnit * kTypical[kind]);
}

// One side of a shape does not tell how thick it is. But closed over its open side it is filled
// much as the whole is, which a piece can rely on.
bool restsOnThickness(std::size_t kind) {
    return kind == static_cast<std::size_t>(Statistic::kThicknessByCentrality) ||
           kind == static_cast<std::size_t>(Statistic::kThicknessByRadius);
}

double termWeight(std::size_t kind, double trust, const ScoreOptions& options) {
    const bool doubted = options.partial ? restsOnThickness(kind) : kStatistics[kind].ofInterior;
    return doubted ? trust : 1.0;
}

double scaleDistance(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return options.keepScale ? std::abs(std::log2(std::max(a.scale, b.scale) / std::min(a.scale, b.scale)))
                             : 0.0;
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
        const double weight = termWeight(kind, interior, options);
        result.statistics += weight * termDistance(a, b, kind);
        result.totalWeight += weight;
    }
    result.partsWeight = kPartsWeight * interior;
    result.totalWeight += result.partsWeight;
    result.scale = scaleDistance(a, b, options);
    return result;
}

double attributeScore(const AttributeDistance& distance, double agreement) {
    return scoreOf(std::hypot(meanDistance(distance, agreement), distance.scale));
}

double pieceScore(const AttributeDistance& distance, double agreement, double share) {
    return scoreOf((1.0 - kContainedWeight) * meanDistance(distance, agreement) +
                   kContainedWeight * disagreement(share));
}

std::vector<ScoreTerm> scoreTerms(const Signature& a, const Signature& b, const ScoreOptions& options,
                                  double agreement) {
    const AttributeDistance distance = attributeDistance(a, b, options);
    const double interior = trust(a, b);
    std::vector<ScoreTerm> terms;
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        terms.push_back({kStatistics[kind].name, termDistance(a, b, kind),
                         termWeight(kind, interior, options) / distance.totalWeight});
    }
    terms.push_back({"parts", disagreement(agreement), distance.partsWeight / distance.totalWeight});
    return terms;
}

std::vector<ScoreTerm> pieceTerms(const Signature& a, const Signature& b, const ScoreOptions& options,
                                  double agreement, double share) {
    std::vector<ScoreTerm> terms = scoreTerms(a, b, options, agreement);
    for (ScoreTerm& term : terms) term.weight *= 1.0 - kContainedWeight;
    terms.push_back({"contained parts", disagreement(share), kContainedWeight});
    return terms;
}

}  // namespace shapedb
