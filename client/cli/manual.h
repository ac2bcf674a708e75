// SPDX-License-Identifier: GPL-3.0-or-later
// Manual pages, made from what the commands say of themselves.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shapedb::cli {

/// "shapedb-admin-key" for `shapedb admin key`.
[[nodiscard]] std::string manualName(const CLI::App& command);

/// The page of a command, in roff, for section 1. `version`: what --version prints.
[[nodiscard]] std::string manualPage(const CLI::App& command, const std::string& version);

}  // namespace shapedb::cli
