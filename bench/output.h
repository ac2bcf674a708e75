// SPDX-License-Identifier: GPL-3.0-or-later
// Writing results to files.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "client/cli/console.h"
#include "core/base/error.h"

namespace shapedb::bench {

/// Writes `text` to `path`, replacing the file atomically.
/// Errors: kFileNotWritable.
[[nodiscard]] Result<void> writeText(const std::string& path, std::string_view text);

/// `value` by a printf format for one double, e.g. "%.2f"; at most 63 characters.
[[nodiscard]] std::string numberText(const char* format, double value);

/// --json FILE|-: to a file, or to standard output instead of the readable text. Empty: nowhere.
/// Call `announceJson` before anything is printed. Errors: kFileNotWritable.
void announceJson(cli::Console& console, const std::string& target);
[[nodiscard]] Result<void> writeJson(cli::Console& console, const std::string& target,
                                     const nlohmann::json& document);

}  // namespace shapedb::bench
