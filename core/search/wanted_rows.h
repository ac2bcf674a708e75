// SPDX-License-Identifier: GPL-3.0-or-later
// Which rows of a block a search looks at. For the sources of this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/search/filter.h"
#include "core/search/signature_block.h"

namespace shapedb {

/// 1 for each row of a block, which must have one, that passes the filter and is not excluded, otherwise 0.
/// Empty: all do.
[[nodiscard]] std::vector<std::uint8_t> wantedRows(const SignatureBlock& block, const Filter& filter,
                                                   std::optional<std::int64_t> excludeId);

}  // namespace shapedb
