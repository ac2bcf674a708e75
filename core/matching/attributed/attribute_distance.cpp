// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/attribute_distance.h"

#include <algorithm>
#include <cmath>

#include "core/matching/score.h"

namespace shapedb {

namespace {

// What two unrelated shapes differ by: medians over pairs of different synthetic families
// (`shapedb-bench typical`). It gives every term an equal say, whatever the number of its bins.
constexpr std::array<double, kStatisticKinds> kTypical{2.17, 3.54, 3.93, 1.04, 4.62, 1.27,
                                                       4.20, 1.69, 2.95, 0.76, 1.56};
constexpr double kTypicalDisagreement = 0.9;

// How much a term counts where the interior is reliable and where it is not: the scan then shows one
// side of the surface, or thin parts in noise. One side of a surface has the same outline as both, as
// it lies, and nearly the same distances.
struct EvidenceWeight {
    double reliable;
    double unreliable;
};
constexpr EvidenceWeight kInsideWeight{1.0, 0.01};
constexpr EvidenceWeight kSurfaceWeight{1.0, 0.5};
constexpr EvidenceWeight kOutlineWeight{0.5, 1.0};

constexpr EvidenceWeight weightOf(Evidence evidence) {
    switch (evidence) {
        case Evidence::kInside: return kInsideWeight;
        case Evidence::kSurface: return kSurfaceWeight;
        case Evidence::kOutline: return kOutlineWeight;
    }
    return {1.0, 1.0};
}

// Most shapes are straight, and thickness by centrality rests on the same paths. More costs retrieval.
constexpr double kBendingWeight = 0.5;

// Partial: how much the contained parts count against how much the two look alike. An unreliable
// interior is cut into other segments than that of the whole.
constexpr EvidenceWeight kContainedWeight{0.5, 0.25};

// The parts say both which parts there are and where they lie: as much as two statistics.
constexpr double kPartsWeight = 2.0;

// How far the bounds give way to rounding. Near 1, a rounding difference in the score is one of 1e-8 in the
// distance.
constexpr double kRelativeSlack = 1e-9;
constexpr double kDistanceSlack = 1e-7;

// An interior of this quality is fully trusted. Below, trust falls fast: a thickness that is off by
// half makes its histograms useless.
constexpr double kTrustedQuality = 0.5;

double trustIn(const Grounds& a, const Grounds& b) {
    const double worse = std::min(a.quality, b.quality) / 255.0;
    const double share = std::min(1.0, worse / kTrustedQuality);
    return share * share * share * share;
}

double between(const EvidenceWeight& weight, double trust) {
    return trust * weight.reliable + (1.0 - trust) * weight.unreliable;
}

// What the grounds of two shapes leave of the weights.
struct Common {
    Common(const Grounds& a, const Grounds& b) : trust(trustIn(a, b)), paths(!a.earlier && !b.earlier) {}

    double trust;
    bool paths;  // of both, so that they can be compared
};

double termWeight(std::size_t kind, const Common& common) {
    const StatisticLayout& layout = kStatistics[kind];
    if (layout.ofPaths && !common.paths) return 0.0;
    const double say = kind == static_cast<std::size_t>(Statistic::kBending) ? kBendingWeight : 1.0;
    return say * between(weightOf(layout.evidence), common.trust);
}

double termDistance(const LevelSums& sums, std::size_t kind) {
    return sums[kind] * kRootPerLevel / kTypical[kind];
}

// Rounding may take an agreement past 1.
double disagreement(double agreement) { return std::max(0.0, 1.0 - agreement) / kTypicalDisagreement; }

double meanDistance(const AttributeDistance& distance, double agreement) {
    return (distance.statistics + distance.partsWeight * disagreement(agreement)) / distance.totalWeight;
}

}  // namespace

std::array<double, kStatisticKinds + 1> typicalDifferences() noexcept {
    std::array<double, kStatisticKinds + 1> differences{};
    std::copy(kTypical.begin(), kTypical.end(), differences.begin());
    differences.back() = kTypicalDisagreement;
    return differences;
}

double statisticsDistance(const LevelSums& sums, Grounds a, Grounds b) {
    const Common common(a, b);
    double distance = 0.0;
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        distance += termWeight(kind, common) * termDistance(sums, kind);
    }
    return distance;
}

AttributeDistance attributeDistance(double statistics, Grounds a, Grounds b, double octaves) {
    const Common common(a, b);
    AttributeDistance result;
    result.statistics = statistics;
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        result.totalWeight += termWeight(kind, common);
    }
    result.partsWeight = kPartsWeight * between(weightOf(Evidence::kInside), common.trust);
    result.totalWeight += result.partsWeight;
    result.containedWeight = between(kContainedWeight, common.trust);
    result.scale = octaves;
    return result;
}

double attributeScore(const AttributeDistance& distance, double agreement) {
    return scoreOfDistance(std::hypot(meanDistance(distance, agreement), distance.scale));
}

double partialScore(const AttributeDistance& distance, double agreement, double share) {
    return scoreOfDistance((1.0 - distance.containedWeight) * meanDistance(distance, agreement) +
                           distance.containedWeight * disagreement(share));
}

LevelWeights levelWeights(Grounds a, Grounds b) {
    const Common common(a, b);
    LevelWeights weights;
    // The total of attributeDistance. That it is summed in another order is within the margin of
    // maxDistanceForScore.
    double total = kPartsWeight * between(weightOf(Evidence::kInside), common.trust);
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        weights.perLevel[kind] = termWeight(kind, common) * kRootPerLevel / kTypical[kind];
        total += termWeight(kind, common);
    }
    for (double& weight : weights.perLevel) weight /= total;
    weights.partial = 1.0 - between(kContainedWeight, common.trust);
    return weights;
}

double maxDistanceForScore(double score) {
    return score > 0.0 ? distanceOfScore(score) * (1.0 + kRelativeSlack) + kDistanceSlack : INFINITY;
}

double maxScoreAtDistance(double distance) {
    // At distance 0 it may be the shape itself.
    return distance > 0.0 ? std::min(1.0, scoreOfDistance(distance) * (1.0 + kRelativeSlack)) : 1.0;
}

double octavesBetween(double scaleA, double scaleB) {
    return std::abs(std::log2(std::max(scaleA, scaleB) / std::min(scaleA, scaleB)));
}

std::vector<ScoreTerm> scoreTerms(const LevelSums& sums, Grounds a, Grounds b, double agreement) {
    const Common common(a, b);
    const AttributeDistance distance = attributeDistance(0.0, a, b, 0.0);
    std::vector<ScoreTerm> terms;
    for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
        terms.push_back({kStatistics[kind].name, termDistance(sums, kind),
                         termWeight(kind, common) / distance.totalWeight});
    }
    terms.push_back({"parts", disagreement(agreement), distance.partsWeight / distance.totalWeight});
    return terms;
}

std::vector<ScoreTerm> partialTerms(const LevelSums& sums, Grounds a, Grounds b, double agreement,
                                    double share) {
    std::vector<ScoreTerm> terms = scoreTerms(sums, a, b, agreement);
    const double contained = between(kContainedWeight, trustIn(a, b));
    for (ScoreTerm& term : terms) term.weight *= 1.0 - contained;
    terms.push_back({"contained parts", disagreement(share), contained});
    return terms;
}

}  // namespace shapedb
