// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/load.h"

#include <algorithm>
#include <fstream>
#include <ios>
#include <iterator>
#include <optional>
#include <sstream>
#include <utility>

#include <CLI/CLI.hpp>
#include <toml++/toml.h>
#include <unistd.h>

#include "common/nearest_name.h"
#include "core/base/return_if_error.h"
#include "server/config/command_line.h"
#include "server/config/settings.h"

namespace shapedb::config {
namespace {

constexpr const char* kPrefix = "SHAPEDB_";
constexpr const char* kConfigVariable = "SHAPEDB_CONFIG";
/// Used by other programs of the project.
constexpr const char* kForeignVariables[] = {"SHAPEDB_DATA",
                                             "SHAPEDB_SERVER",
                                             "SHAPEDB_API_KEY",
                                             "SHAPEDB_API_KEY_FILE",
                                             "SHAPEDB_TLS",
                                             "SHAPEDB_TLS_CA",
                                             "SHAPEDB_CLIENT_CERTIFICATE",
                                             "SHAPEDB_CLIENT_KEY"};

const Setting* findByKey(const std::string& key) {
    const auto& all = settings();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Setting& s) { return s.key == key; });
    return found == all.end() ? nullptr : &*found;
}

/// "WHAT; shapedbd --help lists the settings", with a stop where WHAT is a question.
std::string seeHelp(const std::string& what, const char* listed) {
    return what + (what.back() == '?' ? " " : "; ") + "shapedbd --help lists the " + listed;
}

/// Of all settings.
std::vector<std::string> namesOf(std::string Setting::*name) {
    std::vector<std::string> names;
    for (const Setting& setting : settings()) names.push_back(setting.*name);
    return names;
}

/// By what follows the prefix, which all have.
std::string nearestVariable(const std::string& name) {
    const std::size_t prefix = std::char_traits<char>::length(kPrefix);
    std::vector<std::string> names = namesOf(&Setting::environment);
    for (std::string& one : names) one.erase(0, prefix);
    const std::string found = nearestName(name.substr(prefix), names);
    return found.empty() ? found : kPrefix + found;
}

Result<void> assign(Loaded& loaded, const Setting& setting, const std::string& text,
                    const std::string& origin) {
    const Result<void> assigned = setting.assign(loaded.config, text);
    if (!assigned) {
        return fail(assigned.error().code, origin + ": " + setting.key + ": " + assigned.error().message);
    }
    loaded.origins[setting.key] = origin;
    return {};
}

/// The text of a TOML value if its type is the setting's; empty otherwise.
std::optional<std::string> textOf(const toml::node& node, SettingKind kind) {
    if (const auto* integer = node.as_integer(); integer != nullptr && kind != SettingKind::kText) {
        return std::to_string(integer->get());
    }
    if (const auto* text = node.as_string(); text != nullptr && kind != SettingKind::kInteger) {
        return text->get();
    }
    return std::nullopt;
}

class FileReader {
  public:
    FileReader(Loaded& loaded, std::string path) : loaded_(loaded), path_(std::move(path)) {}

    Result<void> read() {
        const Result<std::string> text = content();
        RETURN_IF_ERROR(text);
        try {
            return readTable(toml::parse(*text, path_), "");
        } catch (const toml::parse_error& error) {
            return fail(ErrorCode::kMalformedFile,
                        place(error.source().begin.line) + ": " + std::string(error.description()));
        }
    }

  private:
    Result<std::string> content() const {
        std::ifstream stream(path_, std::ios::binary);
        try {
            // Opening a directory succeeds; reading it throws, whatever the exception mask.
            std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
            if (stream.is_open() && !stream.bad()) return text;
        } catch (const std::ios_base::failure&) {
        }
        return fail(ErrorCode::kFileNotReadable,
                    "configuration file " + path_ + " cannot be read: check that it exists and may be read");
    }

    std::string place(std::size_t line) const { return path_ + " line " + std::to_string(line); }

    Result<void> readTable(const toml::table& table, const std::string& prefix) {
        for (const auto& [name, node] : table) {
            const std::string key = prefix + std::string(name.str());
            const std::string where = place(node.source().begin.line);
            const Setting* setting = findByKey(key);
            if (setting != nullptr) {
                const auto text = textOf(node, setting->kind);
                if (!text) {
                    return fail(
                        ErrorCode::kInvalidArgument,
                        where + ": " + key + " must be " +
                            (setting->kind == SettingKind::kText ? "text in quotes" : "a whole number") +
                            " (" + setting->range + ")");
                }
                RETURN_IF_ERROR(assign(loaded_, *setting, *text, where));
            } else if (isTable(key) && node.is_table()) {
                RETURN_IF_ERROR(readTable(*node.as_table(), key + "."));
            } else {
                return fail(ErrorCode::kInvalidArgument,
                            seeHelp(where + ": unknown key " + key +
                                        didYouMean(nearestName(key, namesOf(&Setting::key))),
                                    "settings"));
            }
        }
        return {};
    }

    static bool isTable(const std::string& key) {
        const auto& all = settings();
        return std::any_of(all.begin(), all.end(), [&](const Setting& s) {
            return s.key.compare(0, key.size() + 1, key + ".") == 0;
        });
    }

    Loaded& loaded_;
    std::string path_;
};

struct Variables {
    std::map<std::string, std::string> settings;  ///< key -> text
    std::string configFile;
};

Result<Variables> readEnvironment(const std::vector<std::string>& environment) {
    Variables variables;
    for (const std::string& entry : environment) {
        const std::size_t equals = entry.find('=');
        const std::string name = entry.substr(0, equals);
        if (name.compare(0, std::char_traits<char>::length(kPrefix), kPrefix) != 0) continue;
        const std::string value = equals == std::string::npos ? "" : entry.substr(equals + 1);
        const auto& all = settings();
        const auto found =
            std::find_if(all.begin(), all.end(), [&](const Setting& s) { return s.environment == name; });
        if (found != all.end()) {
            variables.settings[found->key] = value;
        } else if (name == kConfigVariable) {
            variables.configFile = value;
        } else if (std::find(std::begin(kForeignVariables), std::end(kForeignVariables), name) ==
                   std::end(kForeignVariables)) {
            const std::string meant = didYouMean(nearestVariable(name));
            return fail(ErrorCode::kInvalidArgument,
                        "unknown environment variable " + name +
                            (meant.empty() ? ": unset it" : meant + " If not, unset it") +
                            "; shapedbd --help lists the settings");
        }
    }
    return variables;
}

std::string tomlString(const std::string& text) {
    std::ostringstream out;
    out << toml::value<std::string>(text);
    return out.str();
}

}  // namespace

Result<CommandLine> parseCommandLine(int argc, const char* const* argv) {
    CommandLine commandLine;
    CLI::App app("shapedbd: the ShapeDB server", "shapedbd");
    bool checkConfig = false;
    app.add_option("--config", commandLine.configFile, "Configuration file (TOML) [SHAPEDB_CONFIG]");
    app.add_flag("--check-config", checkConfig,
                 "Print the effective configuration and where each value comes from, and exit");
    app.set_version_flag("--version", std::string("shapedbd ") + version());
    // Options write to these: the values of a map do not move.
    std::map<std::string, std::string> values;
    std::vector<std::pair<std::string, CLI::Option*>> options;
    const ServerConfig defaults;
    for (const Setting& setting : settings()) {
        const std::string shown = setting.show(defaults);
        const std::string help = setting.help + " " + setting.range + ", default " +
                                 (shown.empty() ? "empty" : shown) + " [" + setting.environment + "]";
        options.emplace_back(setting.key, app.add_option(setting.flag, values[setting.key], help));
    }
    app.footer(
        "Flags override environment variables, which override the file. `shapedbd key --help`: API keys. "
        "`shapedbd man`: this as a page for man(1).");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        commandLine.action = Action::kPrint;
        commandLine.text = app.help();
        return commandLine;
    } catch (const CLI::CallForVersion&) {
        commandLine.action = Action::kPrintVersion;
        commandLine.text = std::string("shapedbd ") + version() + "\n";
        return commandLine;
    } catch (const CLI::ParseError& error) {
        return fail(ErrorCode::kInvalidArgument, seeHelp(commandLineMessage(app, error), "flags"));
    }
    for (const auto& [key, option] : options) {
        if (option->count() > 0) commandLine.flags[key] = values[key];
    }
    if (checkConfig) commandLine.action = Action::kCheckConfig;
    return commandLine;
}

Result<Loaded> load(const CommandLine& commandLine, const std::vector<std::string>& environment) {
    auto loaded = loadEachAlone(commandLine, environment);
    RETURN_IF_ERROR(loaded);
    RETURN_IF_ERROR(validateTogether(loaded->config));
    return loaded;
}

Result<Loaded> loadEachAlone(const CommandLine& commandLine, const std::vector<std::string>& environment) {
    Loaded loaded;
    for (const Setting& setting : settings()) loaded.origins[setting.key] = "default";

    const Result<Variables> variables = readEnvironment(environment);
    RETURN_IF_ERROR(variables);

    const std::string& file = commandLine.configFile.empty() ? variables->configFile : commandLine.configFile;
    if (!file.empty()) {
        RETURN_IF_ERROR(FileReader(loaded, file).read());
    }
    for (const auto& [key, text] : variables->settings) {
        const Setting& setting = *findByKey(key);
        const auto assigned = assign(loaded, setting, text, "environment " + setting.environment);
        RETURN_IF_ERROR(assigned);
    }
    for (const auto& [key, text] : commandLine.flags) {
        const Setting* setting = findByKey(key);
        if (setting == nullptr) return fail(ErrorCode::kInternal, "no setting for flag of " + key);
        const auto assigned = assign(loaded, *setting, text, "flag " + setting->flag);
        RETURN_IF_ERROR(assigned);
    }
    return loaded;
}

std::string describe(const Loaded& loaded) {
    std::ostringstream out;
    for (const Setting& setting : settings()) {
        const std::string text = setting.show(loaded.config);
        const bool bare = setting.kind == SettingKind::kInteger;
        out << setting.key << " = " << (bare ? text : tomlString(text)) << "  # "
            << loaded.origins.at(setting.key) << '\n';
    }
    return out.str();
}

std::vector<std::string> processEnvironment() {
    std::vector<std::string> all;
    for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) all.emplace_back(*entry);
    return all;
}

const char* version() noexcept { return SHAPEDB_VERSION; }

}  // namespace shapedb::config
