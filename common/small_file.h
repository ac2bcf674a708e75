// SPDX-License-Identifier: Apache-2.0
// Files of a person or an operator that are read whole.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/error.h"

namespace shapedb {

/// `what` begins the message: "API key file". Never waits for a pipe, and reads no more than it may keep.
/// Errors, which name the file: kFileNotReadable (missing, no permission, not a regular file); kMalformedFile
/// (more than `most` bytes).
[[nodiscard]] Result<std::string> readSmallFile(const char* what, const std::string& path, std::size_t most);

}  // namespace shapedb
