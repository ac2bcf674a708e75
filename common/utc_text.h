// SPDX-License-Identifier: Apache-2.0
// Points in time, for people and JSON.
#pragma once

#include <ctime>
#include <string>

namespace shapedb {

/// `format` as strftime, of at most 63 characters when written; in UTC. Empty for a year that does not fit.
[[nodiscard]] std::string utcText(std::time_t seconds, const char* format);

}  // namespace shapedb
