// The reader of each format, one .cpp each. Private to client/io: callers use readScan.
//
// All of them read from the file's start, stop at the first defect, and allocate in proportion
// to the bytes that are really there, whatever a header announces. Errors: kMalformedFile,
// kNonFiniteCoordinate (not PCD), kPointLimitExceeded.
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
Result<ScanContent> readXyz(InputFile& file, std::size_t maxPoints);

/// Does the first line of content, after a count or column names, read as a point? Tells scans
/// from notes.
bool looksLikeXyz(InputFile& file);

}  // namespace shapedb::io
