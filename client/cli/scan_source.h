// Scan files as the commands use them: read, made worse on purpose, named.
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
    double noise = 0.0;                   ///< sigma as a share of the bounding-box diagonal
    std::optional<std::uint64_t> points;  ///< random subset of this many
    std::uint64_t seed = 1;
    std::uint64_t meshSamples = ReadOptions{}.meshSamples;
};

/// `flags` must outlive the parsing.
void addScanFlags(CLI::App& command, ScanFlags& flags);

/// For a command that takes several noise levels. The group of the flags, to add to.
CLI::App& addScanFlagsButNoise(CLI::App& command, ScanFlags& flags);

/// The seed of one file: depends on the run's seed and the file's name in the collection only,
/// so that neither order nor thread count nor the other files change what a file gets.
[[nodiscard]] std::uint64_t fileSeed(std::uint64_t seed, const std::string& name);

/// Reads `path`, adds noise to all its points, then subsamples, with random numbers from `seed`.
/// Points drawn from a mesh depend on flags.seed alone.
///
/// Errors: those of readScan; kInvalidArgument when points is below 4.
[[nodiscard]] Result<Scan> loadScan(const std::string& path, const ScanFlags& flags, std::uint64_t seed,
                                    const RunContext& context = {});

/// `path` as seen from `folder`, with '/' between the parts; the file's name when `folder` is the
/// file itself.
[[nodiscard]] std::string relativeName(const std::string& path, const std::string& folder);

/// The same without the ending: "Hand/193.ply" -> "Hand/193". The key of an uploaded file.
[[nodiscard]] std::string withoutEnding(const std::string& name);

}  // namespace shapedb::cli
