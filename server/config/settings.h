// SPDX-License-Identifier: GPL-3.0-or-later
// The table of settings: names in all sources, meaning, range, parser and printer.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/config/server_config.h"

namespace shapedb::config {

enum class SettingKind {
    kText,     ///< a TOML string
    kInteger,  ///< a TOML integer
    kBytes,    ///< a TOML integer, or a string with a unit: "64MiB"
};

struct Setting {
    std::string key;          ///< in the file, "table.name"
    std::string environment;  ///< "SHAPEDB_TABLE_NAME"
    std::string flag;         ///< "--table-name"
    SettingKind kind = SettingKind::kText;
    std::string range;  ///< for people: "1 to 64"
    std::string help;
    /// Checks and stores. Errors: kInvalidArgument; the caller adds key and place.
    std::function<Result<void>(ServerConfig&, const std::string& text)> assign;
    /// In the form that `assign` reads.
    std::function<std::string(const ServerConfig&)> show;
};

/// Long on purpose: nobody should set it by accident or without knowing what it means.
inline constexpr const char* kAnyoneMayDoAll =
    "security.anyone_on_the_network_may_read_change_and_delete_everything";

inline constexpr const char* kMetricsForAnyone = "metrics.anyone_on_the_network_may_read";

/// All settings, in the order of the documentation.
[[nodiscard]] const std::vector<Setting>& settings();

/// Checks settings against each other. Errors: kInvalidArgument naming both keys.
[[nodiscard]] Result<void> validateTogether(const ServerConfig& config);

/// Errors: kInvalidArgument: not HOST:PORT, or the port is not 0 to 65535.
[[nodiscard]] Result<Endpoint> parseEndpoint(const std::string& listen);

}  // namespace shapedb::config
