// Pictures of a similarity matrix with the names of its classes.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/evaluation/similarity_matrix.h"

namespace shapedb::cli {

/// The format by the ending of `path`, in either case: ".png" or ".svg".
///
/// Errors: kUnknownFileFormat for any other ending. A command calls this before it starts long
/// work whose result would have nowhere to go.
[[nodiscard]] Result<void> checkFigurePath(const std::string& path);

/// Writes the raster to `path`, replacing what is there, with the classes' names on the left and
/// on top. PNG: names in a small built-in font that knows ASCII (anything else shows as `?`),
/// names cut after 24 characters. SVG: names in full, in the viewer's font. A name is left out
/// where its band is too narrow to hold it beside its neighbour's.
///
/// Errors: those of `checkFigurePath`; kInvalidArgument when the raster's bytes do not match its
/// size; kFileNotWritable when the file cannot be created or written in full (no partial file
/// stays behind); kOutOfMemory.
[[nodiscard]] Result<void> writeSimilarityFigure(const SimilarityRaster& raster, const std::string& path);

}  // namespace shapedb::cli
