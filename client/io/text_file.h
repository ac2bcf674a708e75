// SPDX-License-Identifier: Apache-2.0
// Writes text to files as ply_writer.h writes points: complete or not at all.
#pragma once

#include <string>

#include "core/base/error.h"

namespace shapedb {

/// Errors: kFileNotWritable, naming the path; kOutOfMemory.
[[nodiscard]] Result<void> writeTextFile(const std::string& path, const std::string& text);

}  // namespace shapedb
