// SPDX-License-Identifier: GPL-3.0-or-later
// Scan files as the commands use them: read, degraded on request, named.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/io/scan_reader.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/preparation/scene.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

/// --noise, --points, --seed, --mesh-samples, --drop-plane and --largest, and --format.
struct ScanFlags {
    double noise = 0.0;                   ///< standard deviation, as a share of the bounding-box diagonal
    std::optional<std::uint64_t> points;  ///< size of a random subset
    std::uint64_t seed = 1;
    std::uint64_t meshSamples = ReadOptions{}.meshSamples;
    std::string format;  ///< in place of the one that the file's ending names; empty: that one
    IsolateOptions isolate;
};

/// `flags` must outlive the parsing.
void addScanFlags(CLI::App& command, ScanFlags& flags);

/// For a command with several noise levels. Returns the group of the flags.
CLI::App& addScanFlagsButNoise(CLI::App& command, ScanFlags& flags);

/// --format, for commands that read files by name, and standard input.
void addFormatFlag(CLI::App& command, ScanFlags& flags);

/// For messages: the path, or what "-" means.
[[nodiscard]] std::string scanName(const std::string& path);

/// Errors: kInvalidArgument if both are standard input.
[[nodiscard]] Result<void> checkReadOnce(const std::string& path, const std::string& other);

/// The seed of one file. Depends only on the run's seed and the file's name in the collection: not on the
/// order of files, the number of threads or the other files.
[[nodiscard]] std::uint64_t fileSeed(std::uint64_t seed, const std::string& name);

/// A sentence about what a scan shows besides its object: a table under it, several objects, and which of
/// them were left out. Empty if there is nothing to say.
[[nodiscard]] std::string sceneText(const Scene& scene, std::size_t points, const IsolateOptions& isolate);
/// {plane: null or {share, point, normal, removed}, objects: [shares]}.
[[nodiscard]] nlohmann::json sceneJson(const Scene& scene, std::size_t points, const IsolateOptions& isolate);

/// A scan as the commands use it.
struct LoadedScan : Scan {
    std::optional<Scene> scene;     ///< of the file, if it was looked at
    std::size_t pointsInScene = 0;  ///< before any were left out
};

/// Reads `path` ("-" is standard input), leaves out what flags.isolate says, adds noise to all points, then
/// takes the subset, with random numbers from `seed`. Points sampled from a mesh depend on flags.seed alone.
///
/// `look`: finds the scene also when nothing is left out.
///
/// Errors: those of readScan and findScene; kInvalidArgument if fewer than 4 points are asked for.
[[nodiscard]] Result<LoadedScan> loadScan(const std::string& path, const ScanFlags& flags, std::uint64_t seed,
                                          const RunContext& context = {}, bool look = false);

/// `error` of `path`, for commands with --key: where there is no such file, the key of a stored shape may
/// have been meant.
[[nodiscard]] Error withKeyHint(Error error, const std::string& path);

/// `path` relative to `folder`, with '/' as separator; the file name if `folder` is the file itself.
[[nodiscard]] std::string relativeName(const std::string& path, const std::string& folder);

/// The key of an uploaded file: its path below `base` (empty: the current folder) without ending, with '/' as
/// separator; without a base the whole path, from below the root, of a file that is not below the current
/// folder. Says which file it is however its path was typed; links are names like any other. Errors:
/// kInvalidArgument (not below `base`), kFileNotReadable (there is no current folder). `keepEnding`: with its
/// ending.
[[nodiscard]] Result<std::string> keyOfFile(const std::string& path, const std::string& base,
                                            bool keepEnding = false);

}  // namespace shapedb::cli
