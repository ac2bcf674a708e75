// SPDX-License-Identifier: GPL-3.0-or-later
// How messages to clients name a file of the server.
#pragma once

#include <string>
#include <utility>

#include "core/base/error.h"

namespace shapedb::catalog {

/// The error with `name` in place of the path: whoever sent the file does not know the server's copy.
[[nodiscard]] inline Error named(Error error, const std::string& path, const std::string& name) {
    const std::string quoted = "'" + path + "'";
    const std::size_t at = error.message.find(quoted);
    if (at != std::string::npos) error.message.replace(at, quoted.size(), name);
    return error;
}

}  // namespace shapedb::catalog
