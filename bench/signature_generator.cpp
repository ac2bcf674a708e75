// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/signature_generator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/pipeline.h"
#include "core/synthetic/families.h"

namespace shapedb::bench {

namespace {

constexpr double kNoise = 0.002;

// Distances of a class from its first anchor and of a shape from its class, chosen so that distances are
// distributed as in a labelled collection (docs/benchmarks.md).
constexpr double kMostOfSecondAnchor = 0.25;
constexpr double kShapeSpread = 0.34;
constexpr double kHardSpread = 0.15;
constexpr double kSpreadOfSpread = 0.6;  // of its logarithm
constexpr double kMostOfThirdAnchor = 0.85;
constexpr std::size_t kFewestClasses = 19;
constexpr std::uint64_t kShapesPerCopy = 10;

// Differences between the parts of a shape and of its class, for a spread of 1.
constexpr double kPartsMove = 0.15;
constexpr double kPartsGrow = 0.6;
constexpr double kPartsLost = 0.5;

std::uint64_t mixed(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
    Random random(seed * 0x9e3779b97f4a7c15ULL + stream * 0xbf58476d1ce4e5b9ULL + index);
    random.next();
    return random.next();
}

// Histograms blend by mass: a shape that is t of another has the share t of its mass in the other's bins.
void blendStatistics(ShapeStatistics& into, const ShapeStatistics& other, double t) {
    for (std::size_t i = 0; i < into.size(); ++i) {
        into[i] = levelOf((1.0 - t) * shareOfLevel(into[i]) + t * shareOfLevel(other[i]));
    }
}

void disturbPoints(std::vector<WeightedPoint>& points, Random& random, double spread) {
    if (points.size() > 1) {
        // From the lightest: the heaviest is the origin and stays.
        for (std::size_t i = points.size() - 1; i > 0; --i) {
            if (random.uniform() < kPartsLost * spread)
                points.erase(points.begin() + static_cast<std::ptrdiff_t>(i));
        }
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        WeightedPoint& p = points[i];
        const auto factor = [&](double sigma) {
            return static_cast<float>(std::exp(sigma * random.normal()));
        };
        const auto room = static_cast<float>(kPartsMove * spread);
        for (float& x : p.position) {
            x = i == 0 ? 0.0f : std::clamp(x + room * static_cast<float>(random.normal()), -1.0f, 1.0f);
        }
        p.weight *= factor(kPartsGrow * spread);
        const float wider = factor(kPartsGrow * spread / 2.0);
        p.maximumRadius *= wider;
        for (float& c : p.covariance) c *= wider * wider;
    }
    std::stable_sort(points.begin() + 1, points.end(),
                     [](const WeightedPoint& a, const WeightedPoint& b) { return a.weight > b.weight; });
    // The heaviest point is the origin.
    for (WeightedPoint& p : points) p.weight = std::min(p.weight, points.front().weight);
}

// Volume and volume shares that fit the weights, with this share of the interior in the points.
void fitVolume(Signature& signature, double share) {
    const double cube = signature.scale * signature.scale * signature.scale;
    double weights = 0.0;
    for (const WeightedPoint& p : signature.points) weights += p.weight;
    signature.volume = weights * cube / share;
    for (WeightedPoint& p : signature.points)
        p.volumeShare = volumeShareOf(p.weight, signature.scale, signature.volume);
}

double shareInPoints(const Signature& signature) {
    double share = 0.0;
    for (const WeightedPoint& p : signature.points) share += p.volumeShare;
    return std::min(share, 0.999);
}

}  // namespace

const char* name(Mixture mixture) noexcept {
    switch (mixture) {
        case Mixture::kPlain: return "plain";
        case Mixture::kDuplicates: return "duplicates";
        case Mixture::kHard: return "hard";
    }
    return "plain";
}

Result<SignatureGenerator> SignatureGenerator::create(const Options& options, const RunContext& context) {
    SignatureGenerator generator;
    generator.mixture_ = options.mixture;
    generator.seed_ = options.seed;
    const auto root = static_cast<std::size_t>(std::sqrt(static_cast<double>(options.expected)));
    generator.classes_ = options.mixture == Mixture::kHard ? kFewestClasses : std::max(kFewestClasses, root);
    std::vector<std::pair<std::string, std::size_t>> members;
    for (const FamilyInfo& family : listFamilies()) {
        for (std::size_t member = 0; member < options.members; ++member)
            members.emplace_back(family.name, member);
    }
    std::vector<Signature> made(members.size());
    std::vector<std::uint8_t> good(members.size(), 0);
    tbb::parallel_for(std::size_t{0}, members.size(), [&](std::size_t i) {
        const auto solid = makeMember(members[i].first, members[i].second, 1);
        ScanOptions scan;
        scan.count = options.points;
        scan.noise = kNoise;
        scan.seed = i + 1;
        const auto points = solid ? scanOf(*solid, scan) : Result<PointCloud>(fail(solid.error()));
        if (!points) return;
        auto description = describe(*points, parametersOf(Profile::kDefault), context);
        if (!description) return;
        made[i] = std::move(description->signature);
        good[i] = 1;
    });
    RETURN_IF_ERROR(context.checkpoint());
    for (std::size_t i = 0; i < made.size(); ++i) {
        if (good[i] != 0) generator.anchors_.push_back(std::move(made[i]));
    }
    if (generator.anchors_.size() < 3) {
        return fail(ErrorCode::kInternal, "fewer than 3 synthetic shapes could be described");
    }
    return generator;
}

std::size_t SignatureGenerator::classOf(std::uint64_t index) const {
    return static_cast<std::size_t>(mixed(seed_, 1, index) % classes_);
}

Signature SignatureGenerator::ofClass(std::uint64_t index) const {
    Random ofClass(mixed(seed_, 2, classOf(index)));
    Signature signature = anchors_[ofClass.below(anchors_.size())];
    const double share = shareInPoints(signature);
    const Signature& second = anchors_[ofClass.below(anchors_.size())];
    blendStatistics(signature.attributes->statistics, second.attributes->statistics,
                    ofClass.uniform(0.0, kMostOfSecondAnchor));
    disturbPoints(signature.points, ofClass, 0.5);

    Random random(mixed(seed_, 3, index));
    const double usual = mixture_ == Mixture::kHard ? kHardSpread : kShapeSpread;
    const double spread = std::min(kMostOfThirdAnchor, usual * std::exp(kSpreadOfSpread * random.normal()));
    const Signature& third = anchors_[random.below(anchors_.size())];
    blendStatistics(signature.attributes->statistics, third.attributes->statistics, spread);
    disturbPoints(signature.points, random, spread);
    signature.attributes->quality =
        static_cast<std::uint8_t>(255.0 * (1.0 - 0.1 * random.uniform() * random.uniform()));
    signature.scale = std::exp(random.normal());
    fitVolume(signature, share);
    return signature;
}

Signature SignatureGenerator::make(std::uint64_t index) const {
    const bool copy = mixture_ == Mixture::kDuplicates && index % kShapesPerCopy == 0 && index > 0;
    Signature signature = ofClass(copy ? index - 1 : index);
    if (copy) {
        // Another scan of the same object.
        Random random(mixed(seed_, 4, index));
        for (std::uint8_t& level : signature.attributes->statistics) {
            if (level > 0 && level < kTopLevel && random.below(6) == 0) {
                level = static_cast<std::uint8_t>(random.below(2) == 0 ? level - 1 : level + 1);
            }
        }
        const double share = shareInPoints(signature);
        disturbPoints(signature.points, random, 0.03);
        fitVolume(signature, share);
    }
    signature.attributes->body = bodyOf(signature.points);
    return signature;
}

}  // namespace shapedb::bench
