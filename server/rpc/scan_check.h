// Whether a scan could be described at all, before it is stored.
#pragma once

#include <vector>

#include "core/base/error.h"

namespace shapedb::rpc {

/// Refuses packed finite points that could never be segmented. What only the segmentation can see (no
/// interior; a scan about as flat as is still allowed) is found later and recorded as FAILED.
///
/// Costs a pass and no memory, unless a few hundred of the points do not span space; then all are
/// looked at, with about 80 bytes a point. Errors: those of `sanitise`.
[[nodiscard]] Result<void> checkUsable(const std::vector<float>& xyz);

}  // namespace shapedb::rpc
