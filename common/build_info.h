// SPDX-License-Identifier: Apache-2.0
// Which sources a program was built from, and how.
#pragma once

namespace shapedb {

/// For people: "commit 5d4d94ac2b1e, Release, GNU 12.2.0". The commit is "unknown" when neither git nor the
/// archive of the sources tells it, and ends in "-modified" when files differed from it. Only the programs
/// link this: whatever links it is linked again after each commit.
[[nodiscard]] const char* buildInfo() noexcept;

}  // namespace shapedb
