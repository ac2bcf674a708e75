// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the disk has room, asked before it is filled.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace shapedb::files {

/// Room that temporary files leave to the database, which shares the disk.
constexpr std::uint64_t kLeftToDatabase = std::uint64_t{256} << 20;

/// Errors: kStorageFull: the file system of `directory` has not `bytes` free beside kLeftToDatabase; `what`
/// begins the message, as "the backup". One whose free space cannot be told has room.
[[nodiscard]] Result<void> requireFreeSpace(const std::string& directory, std::uint64_t bytes,
                                            const std::string& what);

}  // namespace shapedb::files
