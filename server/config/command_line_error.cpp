// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/command_line_error.h"

#include <algorithm>
#include <vector>

#include <CLI/CLI.hpp>

#include "common/nearest_name.h"

namespace shapedb::config {

namespace {

std::vector<std::string> flagsOf(const CLI::App& app) {
    std::vector<std::string> flags;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
    }
    return flags;
}

std::vector<std::string> commandsOf(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

}  // namespace

std::string commandLineMessage(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App* chosen = &app;
    while (!chosen->get_subcommands().empty()) chosen = chosen->get_subcommands().front();
    const std::vector<std::string> unknown = app.remaining(true);
    if (!unknown.empty()) {
        const std::string word = unknown.front().substr(0, unknown.front().find('='));
        const bool flag = word.rfind("--", 0) == 0;
        if (flag) return "unknown flag " + word + didYouMean(nearestName(word, flagsOf(*chosen)));
        const auto commands = commandsOf(*chosen);
        if (!commands.empty())
            return "unknown command '" + word + "'" + didYouMean(nearestName(word, commands));
    }
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return message;
}

}  // namespace shapedb::config
