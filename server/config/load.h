// From command line, environment and file to one checked configuration.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/config/server_config.h"

namespace shapedb::config {

enum class Action {
    kServe,
    kCheckConfig,  ///< print the effective configuration and end
    kPrint,        ///< print `text` (help, version) and end with success
};

struct CommandLine {
    Action action = Action::kServe;
    std::string text;                          ///< for kPrint
    std::string configFile;                    ///< empty: none given
    std::map<std::string, std::string> flags;  ///< key of the setting -> text
};

/// Errors: kInvalidArgument (unknown flag, missing value; named).
[[nodiscard]] Result<CommandLine> parseCommandLine(int argc, const char* const* argv);

struct Loaded {
    ServerConfig config;
    /// Key of each setting -> where its value came from: "default", "FILE line 3",
    /// "environment SHAPEDB_LISTEN" or "flag --listen".
    std::map<std::string, std::string> origins;
};

/// Defaults, then the file, then the environment, then the flags; each value is checked, also
/// one that a later source replaces. `environment` holds "NAME=value" strings, as `environ`.
/// The file is the one of --config or, without it, of SHAPEDB_CONFIG.
///
/// Errors: kFileNotReadable; kMalformedFile (TOML syntax, with the line); kInvalidArgument: an
/// unknown key, an unknown SHAPEDB_ variable, a value outside its range. The message names the
/// key and the place.
[[nodiscard]] Result<Loaded> load(const CommandLine& commandLine,
                                  const std::vector<std::string>& environment);

/// One line for each setting: `key = value  # origin`. Valid TOML.
[[nodiscard]] std::string describe(const Loaded& loaded);

/// The environment of this process, for `load`.
[[nodiscard]] std::vector<std::string> processEnvironment();

/// "0.1.0".
[[nodiscard]] const char* version() noexcept;

}  // namespace shapedb::config
