#include "client/cli/scan_source.h"

#include <filesystem>

#include <CLI/CLI.hpp>

#include "client/cli/checks.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/synthetic/noise.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

void addScanFlags(CLI::App& command, ScanFlags& flags) {
    CLI::App& group = addScanFlagsButNoise(command, flags);
    group
        .add_option(
            "--noise", flags.noise,
            "Add Gaussian noise with this standard deviation, as a share of the bounding-box diagonal")
        ->check(atLeastZero());
}

CLI::App& addScanFlagsButNoise(CLI::App& command, ScanFlags& flags) {
    const auto group = command.add_option_group("Scans", "Applied to a scan after reading it");
    group->add_option("--points", flags.points, "Keep a random subset of this many points, 4 or more");
    group->add_option("--seed", flags.seed, "Seed for noise, subset and mesh samples [1]");
    group
        ->add_option("--mesh-samples", flags.meshSamples,
                     "Points to sample from the surface of a mesh [20000]")
        ->check(aboveZero());
    return *group;
}

std::uint64_t fileSeed(std::uint64_t seed, const std::string& name) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
    for (const char c : name) {
        hash ^= static_cast<unsigned char>(c);
        hash *= 0x100000001b3ULL;
    }
    return Random(seed ^ hash).next();
}

Result<Scan> loadScan(const std::string& path, const ScanFlags& flags, std::uint64_t seed,
                      const RunContext& context) {
    if (flags.points && *flags.points < 4) {
        return fail(ErrorCode::kInvalidArgument,
                    "--points is " + std::to_string(*flags.points) + "; a shape needs at least 4");
    }
    ReadOptions options;
    options.meshSamples = flags.meshSamples;
    options.seed = flags.seed;
    auto scan = readScan(path, options, context);
    RETURN_IF_ERROR(scan);
    // Two streams, so that the subset does not depend on the noise.
    Random random(seed);
    const std::uint64_t noiseSeed = random.next();
    const std::uint64_t subsetSeed = random.next();
    if (flags.noise > 0.0) {
        if (const auto added = addGaussianNoise(scan->points, flags.noise, noiseSeed); !added) {
            return fail(added.error().code, path + ": " + added.error().message);
        }
    }
    if (flags.points && *flags.points < scan->points.size()) {
        scan->points = subsample(scan->points, *flags.points, subsetSeed);
    }
    return scan;
}

std::string relativeName(const std::string& path, const std::string& folder) {
    const fs::path relative =
        fs::path(path).lexically_normal().lexically_relative(fs::path(folder).lexically_normal());
    if (relative.empty() || relative == ".") return fs::path(path).filename().generic_string();
    return relative.generic_string();
}

std::string withoutEnding(const std::string& name) {
    const fs::path path(name);
    return (path.parent_path() / path.stem()).generic_string();
}

}  // namespace shapedb::cli
