// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/scan_source.h"

#include <algorithm>
#include <filesystem>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/text.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/synthetic/degrade.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

void addScanFlags(CLI::App& command, ScanFlags& flags) {
    CLI::App& group = addScanFlagsButNoise(command, flags);
    group
        .add_option(
            "--noise", flags.noise,
            "Add Gaussian noise with this standard deviation, as a share of the bounding-box diagonal")
        ->check(noiseShare());
}

void addFormatFlag(CLI::App& command, ScanFlags& flags) {
    command.add_option("--format", flags.format,
                       "Format of the file, e.g. ply, whatever its name; needed for standard input (-)");
}

std::string scanName(const std::string& path) { return path == "-" ? "standard input" : path; }

Result<void> checkReadOnce(const std::string& path, const std::string& other) {
    if (path != "-" || other != "-") return {};
    return fail(ErrorCode::kInvalidArgument, "standard input can be only one of the two scans");
}

CLI::App& addScanFlagsButNoise(CLI::App& command, ScanFlags& flags) {
    const auto group = command.add_option_group("Scans", "Applied to a scan after reading it");
    group->add_option("--points", flags.points, "Keep a random subset of this many points, 4 or more");
    group->add_option("--seed", flags.seed, "Seed for noise, subset and mesh samples [1]");
    group
        ->add_option("--mesh-samples", flags.meshSamples,
                     "Points to sample from the surface of a mesh [20000]")
        ->check(aboveZero());
    group->add_flag("--drop-plane", flags.isolate.dropPlane,
                    "Leave out the plane that the objects stand on, if there is one");
    group->add_flag("--largest", flags.isolate.largest,
                    "Keep the largest of several separate objects, without the plane");
    return *group;
}

namespace {

/// How many groups of points are listed with their shares.
constexpr std::size_t kMostListed = 8;

double shareOf(std::uint64_t part, std::size_t points) {
    return points > 0 ? static_cast<double>(part) / static_cast<double>(points) : 0.0;
}

Result<void> isolate(const std::string& path, const ScanFlags& flags, LoadedScan& scan,
                     const RunContext& context) {
    auto scene = findScene(scan.points, context);
    if (!scene) return fail(withContext(scene.error(), scanName(path) + ": "));
    scan.pointsInScene = scan.points.size();
    if (flags.isolate.any()) scan.points = isolated(scan.points, *scene, flags.isolate);
    scan.scene = std::move(*scene);
    return {};
}

}  // namespace

std::string sceneText(const Scene& scene, std::size_t points, const IsolateOptions& isolate) {
    std::string text;
    if (scene.plane) {
        text += formatPercent(shareOf(scene.plane->points, points)) + " of the points lie on one plane" +
                (isolate.any() ? ", left out\n" : ": --drop-plane leaves them out\n");
    }
    if (scene.objects.size() > 1) {
        // They may be objects, or parts of one that a camera did not see as a whole.
        text += std::to_string(scene.objects.size()) + " groups of points with gaps between them (";
        for (std::size_t i = 0; i < std::min(kMostListed, scene.objects.size()); ++i) {
            text += (i > 0 ? ", " : "") + formatPercent(shareOf(scene.objects[i], points));
        }
        if (scene.objects.size() > kMostListed) text += ", ...";
        text += isolate.largest ? "), only the largest is kept\n"
                                : "): if they are separate objects, --largest keeps the first\n";
    }
    return text;
}

nlohmann::json sceneJson(const Scene& scene, std::size_t points, const IsolateOptions& isolate) {
    nlohmann::json plane;
    if (scene.plane) {
        const SupportPlane& found = *scene.plane;
        plane = {{"share", shareOf(found.points, points)},
                 {"point", {found.point.x, found.point.y, found.point.z}},
                 {"normal", {found.normal.x, found.normal.y, found.normal.z}},
                 {"removed", isolate.any()}};
    }
    nlohmann::json objects = nlohmann::json::array();
    for (const std::uint64_t object : scene.objects) objects.push_back(shareOf(object, points));
    return {{"plane", plane}, {"objects", objects}};
}

std::uint64_t fileSeed(std::uint64_t seed, const std::string& name) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
    for (const char c : name) {
        hash ^= static_cast<unsigned char>(c);
        hash *= 0x100000001b3ULL;
    }
    return Random(seed ^ hash).next();
}

Error withKeyHint(Error error, const std::string& path) {
    std::error_code unknown;
    const bool missing = fs::status(path, unknown).type() == fs::file_type::not_found;
    if (missing && error.code == ErrorCode::kFileNotReadable)
        error.message += "; a stored shape is named with --key";
    return error;
}

Result<LoadedScan> loadScan(const std::string& path, const ScanFlags& flags, std::uint64_t seed,
                            const RunContext& context, bool look) {
    if (flags.points && *flags.points < 4) {
        return fail(ErrorCode::kInvalidArgument,
                    "--points is " + std::to_string(*flags.points) + "; a shape needs at least 4");
    }
    ReadOptions options;
    options.meshSamples = flags.meshSamples;
    options.seed = flags.seed;
    options.format = flags.format;
    auto read = readScan(path, options, context);
    RETURN_IF_ERROR(read);
    Result<LoadedScan> scan = LoadedScan{std::move(*read), std::nullopt, 0};
    if (look || flags.isolate.any()) RETURN_IF_ERROR(isolate(path, flags, *scan, context));
    // Two streams, so that the subset does not depend on the noise.
    Random random(seed);
    const std::uint64_t noiseSeed = random.next();
    const std::uint64_t subsetSeed = random.next();
    if (flags.noise > 0.0) {
        if (const auto added = addGaussianNoise(scan->points, flags.noise, noiseSeed); !added) {
            return fail(added.error().code, scanName(path) + ": " + added.error().message);
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

Result<std::string> keyOfFile(const std::string& path, const std::string& base, bool keepEnding) {
    const auto named = [&](const fs::path& name) {
        return keepEnding ? name.generic_string() : withoutScanEnding(name.generic_string());
    };
    std::error_code error;
    const fs::path here = fs::current_path(error);
    if (error) return fail(ErrorCode::kFileNotReadable, "the current folder: " + error.message());
    const fs::path file = (here / path).lexically_normal();
    const fs::path folder = (here / base / "").lexically_normal();
    const fs::path below = file.lexically_relative(folder);
    if (!below.empty() && *below.begin() != "..") return named(below);
    if (base.empty()) return named(file.relative_path());
    return fail(ErrorCode::kInvalidArgument, path + " is not below --base " + base);
}

}  // namespace shapedb::cli
