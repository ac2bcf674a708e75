// SPDX-License-Identifier: GPL-3.0-or-later
// Stored rows as what searches read.
#pragma once

#include <memory>
#include <vector>

#include "core/search/signature_block.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::index {

/// Converts a row; `entry` may hold an earlier one. A damaged signature is logged with the shape's key; then
/// false. Damaged views are logged and left out.
[[nodiscard]] bool toEntry(store::IndexRow&& row, IndexEntry& entry, telemetry::Logger& log);

/// The rows, whose ids rise, without those of damaged signatures. At most SignatureBlock::kMostRows.
[[nodiscard]] std::shared_ptr<const SignatureBlock> toBlock(std::vector<store::IndexRow>&& rows,
                                                            telemetry::Logger& log);

}  // namespace shapedb::index
