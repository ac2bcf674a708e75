// SPDX-License-Identifier: GPL-3.0-or-later
// Looks into answers.
#pragma once

#include <string>

#include "server/http/response.h"

namespace shapedb::http {

/// The first field of that name; empty if there is none.
inline std::string fieldOf(const Response& response, const std::string& name) {
    for (const auto& [key, value] : response.fields) {
        if (key == name) return value;
    }
    return {};
}

}  // namespace shapedb::http
