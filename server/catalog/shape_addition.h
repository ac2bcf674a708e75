// SPDX-License-Identifier: GPL-3.0-or-later
// A shape is added: what happens in which order, whatever the transport.
#pragma once

#include <optional>

#include "core/base/error.h"
#include "server/catalog/call_frame.h"
#include "server/catalog/catalog.h"
#include "server/catalog/scan_upload.h"

namespace shapedb::catalog {

/// One call that adds a shape. Used by one thread. The references must outlive it.
class ShapeAddition {
  public:
    /// `maxPoints` and `uploads` as ScanUpload.
    ShapeAddition(Catalog& catalog, CallFrame& frame, std::uint64_t maxPoints, Budget& uploads)
        : catalog_(catalog), frame_(frame), upload_(std::in_place, maxPoints, uploads) {}

    /// Takes the points; until `finish`.
    [[nodiscard]] ScanUpload& upload() { return *upload_; }
    /// Once the header is known, so that a hopeless upload is refused before its points are sent. With
    /// `wait` the call waits at the end until the shape has been segmented. Errors: those of
    /// Catalog::admitUpload; kQueueFull (too many calls wait).
    [[nodiscard]] Result<void> begin(ShapeHeader header, bool wait);
    /// Once all points are there: stores the scan, gives up its share of the upload memory, and waits if that
    /// was asked for. Errors: those of Catalog::put and Catalog::awaitIngest, kCancelled,
    /// kDeadlineExceeded. After kQueueFull the call tells when to try again.
    [[nodiscard]] Result<AddedShape> finish(store::VerifiedScan scan);

  private:
    Catalog& catalog_;
    CallFrame& frame_;
    std::optional<ScanUpload> upload_;
    ShapeHeader header_;
    bool wait_ = false;
};

}  // namespace shapedb::catalog
