// SPDX-License-Identifier: Apache-2.0
// One reader per format. Private to client/io: callers use readScan.
//
// Each starts at the beginning of the file, stops at the first defect, and allocates in proportion to the
// bytes that are really there, not to what a header announces. Errors: kMalformedFile, kNonFiniteCoordinate
// (not PCD), kPointLimitExceeded.
#pragma once

#include <cstddef>

#include "client/io/input_file.h"
#include "client/io/scan_content.h"
#include "core/base/error.h"

namespace shapedb::io {

Result<ScanContent> readPly(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readPcd(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readOff(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readObj(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readStl(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readLas(InputFile& file, std::size_t maxPoints);
/// Also kFileNotReadable: a file that the document names.
Result<ScanContent> readGltf(InputFile& file, std::size_t maxPoints);
Result<ScanContent> read3mf(InputFile& file, std::size_t maxPoints);
Result<ScanContent> readXyz(InputFile& file, std::size_t maxPoints);

/// True if the first line of content, after a count or column names, is a point: tells scans from notes.
bool looksLikeXyz(InputFile& file);

}  // namespace shapedb::io
