// SPDX-License-Identifier: GPL-3.0-or-later
// Command line, environment and file become one checked configuration.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/config/server_config.h"

namespace shapedb::config {

enum class Action {
    kServe,
    kCheckConfig,   ///< print the effective configuration and exit
    kPrint,         ///< print `text` (help) and exit
    kPrintVersion,  ///< print `text` (name and version) and what the program knows of its build, and exit
};

struct CommandLine {
    Action action = Action::kServe;
    std::string text;                          ///< for kPrint
    std::string configFile;                    ///< empty: none given
    std::map<std::string, std::string> flags;  ///< key of the setting -> text
};

/// Errors: kInvalidArgument (unknown option, missing value; named).
[[nodiscard]] Result<CommandLine> parseCommandLine(int argc, const char* const* argv);

struct Loaded {
    ServerConfig config;
    /// Key of each setting -> where its value came from: "default", "FILE line 3",
    /// "environment SHAPEDB_LISTEN" or "flag --listen".
    std::map<std::string, std::string> origins;
};

/// Defaults, then file, environment and flags; later ones win, but every value is checked. The file is
/// that of --config, otherwise of SHAPEDB_CONFIG. `environment` holds "NAME=value" strings, as
/// `environ`.
///
/// Errors, naming key and place: kFileNotReadable; kMalformedFile (TOML syntax); kInvalidArgument
/// (unknown key or SHAPEDB_ variable, value out of range).
[[nodiscard]] Result<Loaded> load(const CommandLine& commandLine,
                                  const std::vector<std::string>& environment);

/// The same without the rules between settings (validateTogether): for what needs some of them only.
[[nodiscard]] Result<Loaded> loadEachAlone(const CommandLine& commandLine,
                                           const std::vector<std::string>& environment);

/// One line for each setting: `key = value  # origin`. Valid TOML.
[[nodiscard]] std::string describe(const Loaded& loaded);

/// The environment of this process, for `load`.
[[nodiscard]] std::vector<std::string> processEnvironment();

/// "0.1.0".
[[nodiscard]] const char* version() noexcept;

}  // namespace shapedb::config
