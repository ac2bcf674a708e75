// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/usage.h"

#include <algorithm>
#include <array>
#include <regex>
#include <utility>

#include <CLI/CLI.hpp>

#include "common/nearest_name.h"

namespace shapedb::cli {

namespace {

bool isFlag(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

/// The long flags of a command, and those of the whole program.
std::vector<std::string> flagsOf(const CLI::App& command) {
    std::vector<std::string> flags;
    for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
        const std::vector<std::string> more = longFlags(optionsOf(*app));
        flags.insert(flags.end(), more.begin(), more.end());
    }
    return flags;
}

/// "list" of the program, "admin stats" of a group.
void collectNames(const CLI::App& app, const std::string& before, std::vector<std::string>& own,
                  std::vector<std::pair<std::string, std::string>>& deeper) {
    for (const CLI::App* sub : shownCommands(app)) {
        if (before.empty()) own.push_back(sub->get_name());
        if (!before.empty()) deeper.emplace_back(sub->get_name(), before + sub->get_name());
        std::vector<std::string> ignored;
        collectNames(*sub, before + sub->get_name() + " ", ignored, deeper);
    }
}

/// What to type in place of an unknown command; empty if nothing is near.
std::string meantCommand(const CLI::App& app, const std::string& typed) {
    std::vector<std::string> own;
    std::vector<std::pair<std::string, std::string>> deeper;
    collectNames(app, {}, own, deeper);
    // `shapedb stats` is `shapedb admin stats`.
    for (const auto& [name, path] : deeper) {
        if (name == typed) return path;
    }
    return nearestName(typed, own);
}

/// What the values of an option are, after "is not".
std::string kindOf(const CLI::App& command, const std::string& name) {
    for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
        for (const CLI::Option* option : optionsOf(*app)) {
            if (!option->check_name(name)) continue;
            const std::string type = option->get_type_name();
            if (option->get_expected_max() == 0) return "true or false";
            if (type.find("UINT") == 0) return "a whole number of 0 or more that is not too large";
            if (type.find("INT") == 0) return "a whole number that is not too large";
        }
    }
    return "a number";
}

/// A sentence of CLI11 in the words of the others; what it says is `pattern`.
struct Rewording {
    const char* pattern;
    std::string (*reworded)(const std::smatch& found, const CLI::App& command);
};

std::string noneOf(const std::smatch& found, const CLI::App&) {
    std::vector<std::string> names = CLI::detail::split(found.str(3), ',');
    std::string text = found.str(1) + ": '" + found.str(2) + "' is none of ";
    for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + names[i];
    return text + didYouMean(nearestName(found.str(2), names));
}

const std::array<Rewording, 6> kRewordings = {{
    {"Could not convert: (\\S+) = (.*)",
     [](const std::smatch& found, const CLI::App& command) {
         return found.str(1) + ": '" + found.str(2) + "' is not " + kindOf(command, found.str(1));
     }},
    {"(\\S+): Value (.*) not in range (\\S+) to (\\S+)",
     [](const std::smatch& found, const CLI::App&) {
         return found.str(1) + ": '" + found.str(2) + "' must be a number, " + found.str(3) + " to " +
                found.str(4);
     }},
    {"(\\S+): (.*) not in \\{(.*)\\}", noneOf},
    {"(\\S+): 1 required \\S+ missing",
     [](const std::smatch& found, const CLI::App&) { return found.str(1) + " needs a value"; }},
    {"(\\S+): At least (\\d+) required but received (\\d+)",
     [](const std::smatch& found, const CLI::App&) {
         return found.str(1) + " needs " + found.str(2) + " values, not " + found.str(3);
     }},
    {"A subcommand is required",
     [](const std::smatch&, const CLI::App&) { return std::string("give a command"); }},
}};

std::string inPlainWords(const std::string& message, const CLI::App& command) {
    for (const Rewording& one : kRewordings) {
        std::smatch found;
        if (std::regex_match(message, found, std::regex(one.pattern))) return one.reworded(found, command);
    }
    return message;
}

std::string complaint(const CLI::App& app, const CLI::App& command, const CLI::ParseError& error) {
    const std::vector<std::string> unknown = app.remaining(true);
    const std::string first = unknown.empty() ? std::string() : unknown.front();
    if (isFlag(first)) return unknownOption(first, flagsOf(command));
    if (!first.empty() && !shownCommands(command).empty()) {
        return "unknown command '" + first + "'" + didYouMean(meantCommand(command, first));
    }
    if (!first.empty()) return "unexpected argument '" + first + "'";
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return inPlainWords(message, command);
}

/// Fields of requests whose flags have other names.
constexpr std::array<std::pair<const char*, const char*>, 8> kFlagsOfFields = {{
    {"verify_candidates", "--candidates"},
    {"key_prefix", "--prefix"},
    {"max_values", "--limit"},
    {"page_size", "--limit"},
    {"metadata_key", "--by"},
    {"forbid_reflection", "--no-reflection"},
    {"adaptive_interior", "--interior"},
    {"k", "-k"},
}};

/// The flag for a word of the server; empty if the command has none.
std::string flagOf(const CLI::App& command, const std::string& word, bool endsInColon) {
    const auto has = [&](const std::string& flag) { return command.get_option_no_throw(flag) != nullptr; };
    for (const auto& [field, flag] : kFlagsOfFields) {
        if (word == field && has(flag) && (endsInColon || word.size() > 1)) return flag;
    }
    // A word without '_' may be plain English.
    if (word.find('_') == std::string::npos && !endsInColon) return {};
    std::string flag = "--" + word;
    std::replace(flag.begin(), flag.end(), '_', '-');
    return has(flag) ? flag : std::string();
}

bool isFieldLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; }

}  // namespace

std::vector<const CLI::Option*> optionsOf(const CLI::App& command) {
    auto options =
        command.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
    for (const CLI::App* sub :
         command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); })) {
        const auto more = optionsOf(*sub);
        options.insert(options.end(), more.begin(), more.end());
    }
    return options;
}

std::vector<const CLI::App*> shownCommands(const CLI::App& app) {
    return app.get_subcommands(
        [](const CLI::App* sub) { return !sub->get_name().empty() && !sub->get_group().empty(); });
}

const CLI::App& chosenCommand(const CLI::App& app) {
    const CLI::App* at = &app;
    while (!at->get_subcommands().empty() && !at->get_subcommands().front()->get_name().empty()) {
        at = at->get_subcommands().front();
    }
    return *at;
}

std::string fullName(const CLI::App& command) {
    const CLI::App* parent = command.get_parent();
    return parent == nullptr ? command.get_name() : fullName(*parent) + " " + command.get_name();
}

std::string usageMessage(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = chosenCommand(app);
    return complaint(app, command, error) + " (see '" + fullName(command) + " --help')";
}

std::string inWordsOfFlags(const CLI::App& app, const std::string& message) {
    const CLI::App& command = chosenCommand(app);
    std::string text;
    for (std::size_t at = 0; at < message.size();) {
        std::size_t end = at;
        while (end < message.size() && isFieldLetter(message[end])) ++end;
        if (end == at) {
            text += message[at++];
            continue;
        }
        const std::string word = message.substr(at, end - at);
        const char before = at == 0 ? ' ' : message[at - 1];
        // Not inside names, paths and values.
        const bool alone =
            (before == ' ' || before == '(') &&
            (end == message.size() || std::string(" :,;.)").find(message[end]) != std::string::npos);
        const bool colon = at == 0 && end < message.size() && message[end] == ':';
        const std::string flag = alone ? flagOf(command, word, colon) : std::string();
        text += flag.empty() ? word : flag;
        at = end;
    }
    return text;
}

namespace {

/// Text as roff prints it: no line begins a request, hyphens can be copied.
std::string roff(const std::string& text) {
    std::string out;
    bool lineBegins = true;
    for (const char c : text) {
        if (lineBegins && (c == '.' || c == '\'')) out += "\\&";
        lineBegins = c == '\n';
        if (c == '\\') {
            out += "\\e";
        } else if (c == '-') {
            out += "\\-";
        } else {
            out += c;
        }
    }
    return out;
}

std::string section(const std::string& title) { return ".SH " + title + "\n"; }

/// "FILE" of an option that takes one; "..." if several.
std::string valueOf(const CLI::Option& option) {
    if (option.get_items_expected_max() == 0) return {};
    std::string value = option.get_type_name();
    // CLI11 has its own names for plain types, and adds those of checks.
    if (value.rfind("TEXT:{", 0) == 0 || value.rfind("ROLE:{", 0) == 0) {
        value.erase(0, 5);
    } else if (value.rfind("INT", 0) == 0 || value.rfind("UINT", 0) == 0) {
        value = "N";
    } else if (value.rfind("FLOAT", 0) == 0) {
        value = "NUMBER";
    }
    value = value.substr(0, value.find(':'));
    if (value.empty()) value = "VALUE";
    if (option.get_items_expected_max() > 1) value += "...";
    return value;
}

std::string optionEntry(const CLI::Option& option) {
    std::string text = ".TP\n";
    if (option.get_positional()) {
        text += "\\fI" + roff(option.get_name(true)) + "\\fR";
    } else {
        std::string names;
        for (const std::string& name : option.get_snames())
            names += (names.empty() ? "" : ", ") + ("-" + name);
        for (const std::string& name : option.get_lnames())
            names += (names.empty() ? "" : ", ") + ("--" + name);
        text += "\\fB" + roff(names) + "\\fR";
        const std::string value = valueOf(option);
        if (!value.empty()) text += " \\fI" + roff(value) + "\\fR";
    }
    text += "\n" + roff(option.get_description());
    if (!option.get_default_str().empty()) text += roff(" [" + option.get_default_str() + "]");
    if (!option.get_envname().empty()) text += "\n.br\nEnvironment: " + roff(option.get_envname());
    if (option.get_required()) text += "\n.br\nRequired.";
    return text + "\n";
}

std::string optionsSection(const CLI::App& command) {
    std::string positional;
    std::string flags;
    for (const CLI::Option* option : optionsOf(command)) {
        (option->get_positional() ? positional : flags) += optionEntry(*option);
    }
    std::string text;
    if (!positional.empty()) text += section("ARGUMENTS") + positional;
    if (!flags.empty()) text += section("OPTIONS") + flags;
    return text;
}

std::string synopsis(const CLI::App& command) {
    std::string text = section("SYNOPSIS") + "\\fB" + roff(fullName(command)) + "\\fR";
    if (!shownCommands(command).empty()) return text + " \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n";
    for (const CLI::Option* option : optionsOf(command)) {
        if (!option->get_positional()) continue;
        std::string name = "\\fI" + roff(option->get_name(true)) + "\\fR";
        if (option->get_items_expected_max() > 1) name += "...";
        text += option->get_required() ? " " + name : " [" + name + "]";
    }
    return text + " [\\fIOPTIONS\\fR]\n";
}

}  // namespace

std::string manualName(const CLI::App& command) {
    std::string name = fullName(command);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string manualPage(const CLI::App& command, const std::string& version) {
    std::string title = manualName(command);
    std::transform(title.begin(), title.end(), title.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    std::string description = command.get_description();
    const std::string brief = description.substr(0, description.find_first_of(":.;\n"));
    std::string text = ".TH " + roff(title) + " 1 \"\" \"" + version + "\" \"ShapeDB\"\n";
    text += section("NAME") + roff(manualName(command) + " - " + brief) + "\n";
    text += synopsis(command);
    text += section("DESCRIPTION") + roff(description) + "\n";
    const auto commands = shownCommands(command);
    if (!commands.empty()) {
        text += section("COMMANDS");
        for (const CLI::App* sub : commands) {
            text += ".TP\n\\fB" + roff(sub->get_name()) + "\\fR\n" + roff(sub->get_description()) + "\n";
        }
    }
    text += optionsSection(command);
    if (command.get_parent() != nullptr) {
        text +=
            ".PP\nOptions of every command, such as \\fB\\-\\-json\\fR and \\fB\\-\\-server\\fR, are in "
            "\\fBshapedb\\fR(1).\n";
    }
    if (!command.get_footer().empty()) {
        text += section("NOTES") + ".nf\n" + roff(command.get_footer()) + "\n.fi\n";
    }
    std::string also;
    if (command.get_parent() != nullptr) also = "\\fB" + roff(manualName(*command.get_parent())) + "\\fR(1)";
    for (const CLI::App* sub : commands) {
        also += (also.empty() ? "" : ", ") + ("\\fB" + roff(manualName(*sub)) + "\\fR(1)");
    }
    if (!also.empty()) text += section("SEE ALSO") + also + "\n";
    return text;
}

}  // namespace shapedb::cli
