#include "bench/stored_shapes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "core/signature/profile.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "server/index/parameters_codec.h"
#include "server/store/bulk_fill.h"

namespace shapedb::bench {

namespace {

constexpr double kScanNoise = 0.005;  // of the diagonal
constexpr std::size_t kRealPerFamily = 4;
// How far a made signature may lie from its real ones: about what two shapes of one family differ.
constexpr double kPositionSpread = 0.05;  // of the scale
constexpr double kWeightSpread = 0.15;
constexpr double kMomentSpread = 0.2;
constexpr double kBinSpread = 6.0;   // of 255
constexpr double kLargestMix = 0.5;  // of a second real signature
constexpr std::uint64_t kStride = 0x9e3779b97f4a7c15ULL;

/// Runs `work(i)` for all i < count, on so many threads. The first error ends it.
template <typename Work>
Result<void> forEach(std::size_t count, unsigned threads, const RunContext& context, Work&& work) {
    std::vector<std::optional<Error>> errors(count);
    std::atomic<bool> stop{false};
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute([&] {
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
            if (stop) return;
            Result<void> done = context.checkpoint();
            if (done) done = work(i);
            if (done) return;
            errors[i] = done.error();
            stop = true;
        });
    });
    for (const auto& error : errors) {
        if (error) return fail(*error);
    }
    return {};
}

Result<PointCloud> makeScan(std::size_t index, std::size_t points, std::uint64_t seed) {
    const auto families = listFamilies();
    const auto solid = makeMember(families[index % families.size()].name, index / families.size(), seed);
    if (!solid) return fail(solid.error());
    ScanOptions options;
    options.count = points;
    options.noise = kScanNoise;
    options.seed = seed + index;
    return scanOf(*solid, options);
}

/// The first point must stay the heaviest and the origin.
void order(std::vector<SignaturePoint>& points) {
    std::stable_sort(points.begin(), points.end(),
                     [](const SignaturePoint& a, const SignaturePoint& b) { return a.weight > b.weight; });
    const std::array<float, 3> origin = points.front().position;
    for (SignaturePoint& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) point.position[axis] -= origin[axis];
    }
}

void vary(Signature& signature, Random& random) {
    double sum = 0.0;
    for (SignaturePoint& point : signature.points) {
        for (float& v : point.position) v += static_cast<float>(kPositionSpread * random.normal());
        point.weight *= static_cast<float>(std::exp(kWeightSpread * random.normal()));
        const auto moments = static_cast<float>(std::exp(kMomentSpread * random.normal()));
        for (float& v : point.covariance) v *= moments;
        sum += point.weight;
    }
    order(signature.points);
    // No heavier than the whole.
    const double cube = std::pow(signature.scale, 3);
    signature.volume = std::max(signature.volume, 1.001 * sum * cube);
}

void mix(ShapeStatistics& bins, const ShapeStatistics& other, Random& random) {
    const double share = random.uniform(0.0, kLargestMix);
    for (std::size_t i = 0; i < bins.size(); ++i) {
        const double between = (1.0 - share) * bins[i] + share * other[i];
        if (between == 0.0) continue;
        const double varied = std::clamp(between + kBinSpread * random.normal(), 0.0, 255.0);
        bins[i] = static_cast<std::uint8_t>(std::lround(varied));
    }
}

}  // namespace

Result<std::vector<PointCloud>> makeScans(std::size_t count, std::size_t points, std::uint64_t seed,
                                          unsigned threads, const RunContext& context) {
    std::vector<PointCloud> scans(count);
    const auto made = forEach(count, threads, context, [&](std::size_t i) -> Result<void> {
        auto scan = makeScan(i, points, seed);
        if (!scan) return fail(scan.error());
        scans[i] = std::move(*scan);
        return {};
    });
    if (!made) return fail(made.error());
    return scans;
}

Result<SignatureSource> SignatureSource::create(std::uint64_t seed, std::size_t points, unsigned threads,
                                                const RunContext& context) {
    SignatureSource source;
    source.seed_ = seed;
    source.real_.resize(kRealPerFamily * listFamilies().size());
    const auto made = forEach(source.real_.size(), threads, context, [&](std::size_t i) -> Result<void> {
        const auto scan = makeScan(i, points, seed);
        if (!scan) return fail(scan.error());
        RunContext stoppable;
        stoppable.cancel = context.cancel;
        auto description = describe(*scan, parametersOf(Profile::kDefault), stoppable);
        if (!description) return fail(description.error());
        source.real_[i] = std::move(description->signature);
        return {};
    });
    if (!made) return fail(made.error());
    return source;
}

std::string SignatureSource::encoded(std::uint64_t index) const {
    Random random(seed_ + kStride * (index + 1));
    Signature signature = real_[index % real_.size()];
    vary(signature, random);
    const Signature& other = real_[random.below(real_.size())];
    if (signature.attributes && other.attributes)
        mix(signature.attributes->statistics, other.attributes->statistics, random);
    return encodeSignature(signature);
}

std::string SignatureSource::family(std::uint64_t index) const {
    const auto families = listFamilies();
    return families[index % real_.size() % families.size()].name;
}

Result<void> fillDataDirectory(const std::string& data, const SignatureSource& source, std::uint64_t count,
                               const RunContext& context) {
    std::error_code error;
    std::filesystem::create_directories(data, error);
    store::SqliteOptions options;
    options.path = data + "/shapedb.sqlite";
    return store::fillDatabase(
        options, "default", index::encodeParameters(parametersOf(Profile::kDefault)), count,
        [&](std::uint64_t i) {
            return store::FillShape{
                "shape-" + std::to_string(i), {{"family", source.family(i)}}, source.encoded(i)};
        },
        context);
}

}  // namespace shapedb::bench
