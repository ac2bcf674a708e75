// Databases of a size that nobody uploads for a measurement.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/signature/signature.h"

namespace shapedb::bench {

/// Seeded scans of the project's synthetic families in turn, each another member in another pose, with
/// noise of 0.5 % of the diagonal. Errors: kCancelled, kInvalidArgument (points).
[[nodiscard]] Result<std::vector<PointCloud>> makeScans(std::size_t count, std::size_t points,
                                                        std::uint64_t seed, unsigned threads,
                                                        const RunContext& context);

/// Of the scans behind a SignatureSource: enough for the segments that 20,000 show.
constexpr std::size_t kSourcePoints = 4'000;

/// Signatures like those of a large collection: real ones of synthetic scans, and between and around
/// them as many others as wanted. Immutable; thread-safe.
class SignatureSource {
  public:
    /// Describes some tens of scans of `points` points with the default profile. Errors: those of `describe`.
    [[nodiscard]] static Result<SignatureSource> create(std::uint64_t seed, std::size_t points,
                                                        unsigned threads, const RunContext& context);

    /// Number `index`, encoded. Same seed and index: same bytes.
    [[nodiscard]] std::string encoded(std::uint64_t index) const;
    /// The family that number `index` mostly is of.
    [[nodiscard]] std::string family(std::uint64_t index) const;

  private:
    std::uint64_t seed_ = 0;
    std::vector<Signature> real_;
};

/// The file that a server with the data directory `data` (created here) opens, with `count` shapes in
/// the collection "default": key, one label and signature each. Errors: those of fillDatabase.
[[nodiscard]] Result<void> fillDataDirectory(const std::string& data, const SignatureSource& source,
                                             std::uint64_t count, const RunContext& context);

}  // namespace shapedb::bench
