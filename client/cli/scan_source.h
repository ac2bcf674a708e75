// Scan files as the commands use them: read, degraded on request, named.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/io/scan_reader.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

/// --noise, --points, --seed and --mesh-samples.
struct ScanFlags {
    double noise = 0.0;                   ///< standard deviation, as a share of the bounding-box diagonal
    std::optional<std::uint64_t> points;  ///< size of a random subset
    std::uint64_t seed = 1;
    std::uint64_t meshSamples = ReadOptions{}.meshSamples;
};

/// `flags` must outlive the parsing.
void addScanFlags(CLI::App& command, ScanFlags& flags);

/// For a command with several noise levels. Returns the group of the flags.
CLI::App& addScanFlagsButNoise(CLI::App& command, ScanFlags& flags);

/// The seed of one file. Depends only on the run's seed and the file's name in the collection: not on the
/// order of files, the number of threads or the other files.
[[nodiscard]] std::uint64_t fileSeed(std::uint64_t seed, const std::string& name);

/// Reads `path`, adds noise to all points, then takes the subset, with random numbers from `seed`. Points
/// sampled from a mesh depend on flags.seed alone.
///
/// Errors: those of readScan; kInvalidArgument if fewer than 4 points are asked for.
[[nodiscard]] Result<Scan> loadScan(const std::string& path, const ScanFlags& flags, std::uint64_t seed,
                                    const RunContext& context = {});

/// `path` relative to `folder`, with '/' as separator; the file name if `folder` is the file itself.
[[nodiscard]] std::string relativeName(const std::string& path, const std::string& folder);

/// "Hand/193.ply" -> "Hand/193": the key of an uploaded file.
[[nodiscard]] std::string withoutEnding(const std::string& name);

}  // namespace shapedb::cli
