// SPDX-License-Identifier: GPL-3.0-or-later
// From a scan to its signature, as the server runs it: for callers who wait, and in the background
// for scans in the store.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/pipeline.h"
#include "server/store/store.h"

namespace shapedb::ingest {

/// `shapedb::describe`, or in tests something quicker. Must be thread-safe.
using Describe =
    std::function<Result<Description>(const PointCloud&, const ShapeParameters&, const RunContext&)>;

/// What became of one stored scan.
struct PipelineOutcome {
    enum class Kind {
        kSignature,    ///< `signature` and `seconds` are set
        kCancelled,    ///< by the context
        kScanFailed,   ///< `why`: trying again would fail again
        kStoreFailed,  ///< `why`: the scan is not to blame, a later try may succeed
    };
    Kind kind = Kind::kSignature;
    std::string signature;  ///< encoded
    std::string surface;    ///< encoded surface points; empty if the scan has none
    std::string views;      ///< encoded; empty if the parameters or the scan have none
    double seconds = 0.0;   ///< of the segmentation
    Error why{ErrorCode::kInternal, ""};
};

/// Of an outcome that is kSignature, for a shape with these points.
[[nodiscard]] inline store::SignatureRow rowOf(PipelineOutcome made, std::int64_t shapeId,
                                               std::int64_t pointsVersion, std::int64_t generation) {
    return {shapeId,
            pointsVersion,
            generation,
            std::move(made.signature),
            std::move(made.surface),
            std::move(made.views)};
}

/// Thread-safe. Copies share nothing.
class SignaturePipeline {
  public:
    /// Implicit: a function stands for the pipeline that runs it.
    template <typename Function, std::enable_if_t<std::is_constructible_v<Describe, Function>, int> = 0>
    SignaturePipeline(Function&& describe) : describe_(std::forward<Function>(describe)) {}

    /// `points` are packed x y z relative to `origin`, which positions of the signature have added (those of
    /// the segmentation do not). Uses the threads of the calling task arena. Errors: those of the function;
    /// throws what it throws, and std::bad_alloc.
    [[nodiscard]] Result<Description> describe(const std::vector<float>& points, const Point3& origin,
                                               const ShapeParameters& parameters,
                                               const RunContext& context) const;

    /// Loads a stored scan, describes it on the calling thread alone and encodes its signature. Where memory
    /// is short it waits and tries again. Throws nothing: exceptions become kScanFailed.
    [[nodiscard]] PipelineOutcome run(store::Store& store, std::int64_t shapeId,
                                      const ShapeParameters& parameters, const RunContext& context) const;

    /// How long to wait before each further try where memory is short; for tests.
    void pauseWithoutMemory(std::vector<std::chrono::milliseconds> pauses) {
        pausesWithoutMemory_ = std::move(pauses);
    }

  private:
    Describe describe_;
    std::vector<std::chrono::milliseconds> pausesWithoutMemory_{
        std::chrono::milliseconds(500), std::chrono::milliseconds(2'000), std::chrono::milliseconds(8'000)};
};

/// Errors of the store or the machine, not of the scan: a later try may succeed.
[[nodiscard]] bool isTransient(ErrorCode code) noexcept;

/// Inside a catch block of a worker: what the exception means for the scan it was segmenting.
/// kOutOfMemory or kInternal.
[[nodiscard]] Error errorOfException();

}  // namespace shapedb::ingest
