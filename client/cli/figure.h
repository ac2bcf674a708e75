// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of a similarity matrix, labelled with the class names.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/evaluation/similarity_matrix.h"

namespace shapedb::cli {

/// Commands call this before starting long work. Errors: kUnknownFileFormat unless `path` ends in ".png" or
/// ".svg" (in either case).
[[nodiscard]] Result<void> checkFigurePath(const std::string& path);

/// Writes the raster to `path`, replacing an existing file, with the class names on the left and on top. PNG:
/// a small built-in font, ASCII only (anything else becomes `?`), names cut to 24 characters. SVG: full names
/// in the viewer's font. A name whose band is too narrow for it is left out.
///
/// Errors: those of `checkFigurePath`; kInvalidArgument (the raster's bytes do not match its size);
/// kFileNotWritable (no partial file is left behind); kOutOfMemory.
[[nodiscard]] Result<void> writeSimilarityFigure(const SimilarityRaster& raster, const std::string& path);

}  // namespace shapedb::cli
