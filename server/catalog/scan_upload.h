// SPDX-License-Identifier: GPL-3.0-or-later
// Receives the points of one upload, whatever the transport.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/preparation/scene.h"
#include "server/catalog/gates.h"
#include "server/store/verified_scan.h"

namespace shapedb::catalog {

/// Takes a header and chunks in the order they arrive. Memory grows with what has arrived, not with
/// what was announced. One per upload; not thread-safe. After an error only destruction.
class ScanUpload {
  public:
    /// `maxPoints`: config limits.max_points. `budget` (bytes) is not owned; the upload's share is
    /// returned with this object.
    ScanUpload(std::uint64_t maxPoints, Budget& budget) : maxPoints_(maxPoints), share_(budget) {}

    /// The points to come are relative to `origin`. Errors: kMalformedStream (second header), kTooFewPoints,
    /// kPointLimitExceeded, kInvalidArgument (sha256 neither empty nor 32 bytes), kNonFiniteCoordinate and
    /// kCoordinateOutOfRange (origin).
    [[nodiscard]] Result<void> begin(std::uint64_t announced, const std::string& sha256,
                                     const Point3& origin = {});

    /// Errors: kMalformedStream (before the header; empty, too long or not whole points; after the last
    /// announced point), kCountMismatch (more points than announced), kNonFiniteCoordinate, kQueueFull
    /// (memory of all uploads together).
    [[nodiscard]] Result<void> add(const std::string& xyz);

    /// The stream has ended. Errors: kMalformedStream (no header), kCountMismatch (fewer points than
    /// announced), those of store::ScanVerifier::finish.
    [[nodiscard]] Result<store::VerifiedScan> finish();

    [[nodiscard]] std::uint64_t points() const { return verifier_.pointCount(); }

  private:
    Result<void> checkChunk(const std::string& xyz) const;

    std::uint64_t maxPoints_;
    Budget::Share share_;
    std::optional<std::uint64_t> announced_;
    std::optional<store::Checksum> expected_;
    store::ScanVerifier verifier_;
};

/// The part of a scan that `options` keep; the scan itself if that is all of it. Errors: those of findScene
/// and of store::ScanVerifier::finish (too few points are left).
[[nodiscard]] Result<store::VerifiedScan> isolated(store::VerifiedScan scan, const IsolateOptions& options,
                                                   const RunContext& context);

}  // namespace shapedb::catalog
