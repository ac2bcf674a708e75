// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/shape_addition.h"

#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::catalog {

Result<void> ShapeAddition::begin(ShapeHeader header, bool wait) {
    header_ = std::move(header);
    wait_ = wait;
    RETURN_IF_ERROR(catalog_.admitUpload(header_));
    return wait_ ? frame_.becomeFollower() : Result<void>();
}

Result<AddedShape> ShapeAddition::finish(store::VerifiedScan scan) {
    RETURN_IF_ERROR(frame_.run().checkpoint());
    auto added = catalog_.put(header_, std::move(scan));
    if (!added && added.error().code == ErrorCode::kQueueFull) {
        frame_.retryAfter(catalog_.retryAfterQueueFull());
    }
    RETURN_IF_ERROR(added);
    upload_.reset();
    if (wait_) {
        auto settled = catalog_.awaitIngest(added->shape, [&] { return frame_.run().checkpoint(); });
        RETURN_IF_ERROR(settled);
        added->shape = std::move(*settled);
    }
    return added;
}

}  // namespace shapedb::catalog
