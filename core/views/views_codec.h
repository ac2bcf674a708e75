// SPDX-License-Identifier: GPL-3.0-or-later
// The persisted byte form of views: docs/views.md describes every byte. Never change it; add a version.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/views/views.h"

namespace shapedb {

/// Little-endian on every machine: 1,372 bytes.
[[nodiscard]] std::string encodeViews(const ViewSet& set);

/// The exact inverse. Any other bytes are refused: kDataLoss (length, magic, checksum, number of views,
/// sizes that are negative, infinite or NaN), kSchemaTooNew (a version written by a newer program). The
/// message says which.
[[nodiscard]] Result<ViewSet> decodeViews(const std::string& bytes);

}  // namespace shapedb
