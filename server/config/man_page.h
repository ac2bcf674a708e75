// SPDX-License-Identifier: GPL-3.0-or-later
// The manual page of shapedbd.
#pragma once

#include <string>

namespace shapedb::config {

/// shapedbd(8) as input of man(1), with every setting of settings().
[[nodiscard]] std::string manPage();

}  // namespace shapedb::config
