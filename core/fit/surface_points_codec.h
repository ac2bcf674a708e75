// SPDX-License-Identifier: GPL-3.0-or-later
// The persisted byte form of surface points: docs/fit.md describes every byte. Never change it; add a
// version.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/fit/surface_points.h"

namespace shapedb {

/// Little-endian on every machine: 44 bytes and 8 a point.
[[nodiscard]] std::string encodeSurfacePoints(const SurfacePoints& surface);

/// The exact inverse, for what makeSurfacePoints gives. Any other bytes are refused: kDataLoss (length,
/// magic, checksum, number of points, a centre or unit that no scan has, coordinates or normals out of range,
/// points that do not fill their frame), kSchemaTooNew (a version written by a newer program), kOutOfMemory.
/// The message says which.
[[nodiscard]] Result<SurfacePoints> decodeSurfacePoints(const std::string& bytes);

}  // namespace shapedb
