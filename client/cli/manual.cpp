// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/manual.h"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "client/cli/usage.h"

namespace shapedb::cli {

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
