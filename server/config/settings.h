// The one table of settings: name in every source, meaning, range, parser and printer.
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
    /// Checks and stores. Errors: kInvalidArgument, without the key (the caller knows where
    /// the text came from and adds it).
    std::function<Result<void>(ServerConfig&, const std::string& text)> assign;
    /// As `assign` would read it back.
    std::function<std::string(const ServerConfig&)> show;
};

/// Every setting, in the order of the documentation. Immutable.
[[nodiscard]] const std::vector<Setting>& settings();

/// Checks between settings that each are fine alone. Errors: kInvalidArgument naming both keys.
[[nodiscard]] Result<void> validateTogether(const ServerConfig& config);

/// Errors: kInvalidArgument: not HOST:PORT, or the port is not 0 to 65535.
[[nodiscard]] Result<Endpoint> parseEndpoint(const std::string& listen);

}  // namespace shapedb::config
