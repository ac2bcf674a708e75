// SPDX-License-Identifier: GPL-3.0-or-later
// The shapes of which a view is most like a scan of one side: candidates for verifying (verify.h).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/search/filter.h"
#include "core/search/signature_set.h"
#include "core/views/view_distance.h"

namespace shapedb {

struct ViewHit {
    std::int64_t id = 0;
    std::uint32_t distance = 0;  ///< ViewQuery::distance of its nearest view
};

/// The `count` shapes with the least distance of those that have views, pass `filter` and are not
/// `excludeId`: in ascending order of distance, ties in ascending order of id. Exact. Uses the threads of the
/// caller's oneTBB arena; their number changes nothing. Reports progress as stage "views".
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<std::vector<ViewHit>> nearestByViews(const ViewQuery& query, const SignatureSet& set,
                                                          std::size_t count, const Filter& filter,
                                                          std::optional<std::int64_t> excludeId,
                                                          const RunContext& context = {});

}  // namespace shapedb
