// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/usage.h"

#include <algorithm>
#include <array>
#include <utility>

#include <CLI/CLI.hpp>

namespace shapedb::cli {

namespace {

/// Insertions, deletions, replacements and swaps of neighbours that make one word the other.
std::size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
            const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    }
    return d[a.size()][b.size()];
}

bool isFlag(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

/// The long flags of a command, and those of the whole program.
std::vector<std::string> flagsOf(const CLI::App& command) {
    std::vector<std::string> flags;
    for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
        for (const CLI::Option* option : optionsOf(*app)) {
            for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
        }
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

std::string meant(const std::string& name) { return name.empty() ? "" : ": did you mean '" + name + "'?"; }

std::string complaint(const CLI::App& app, const CLI::App& command, const CLI::ParseError& error) {
    const std::vector<std::string> unknown = app.remaining(true);
    const std::string first = unknown.empty() ? std::string() : unknown.front();
    if (isFlag(first)) {
        const std::string flag = first.substr(0, first.find('='));
        return "unknown option '" + flag + "'" + meant(nearestName(flag, flagsOf(command)));
    }
    if (!first.empty() && !shownCommands(command).empty()) {
        return "unknown command '" + first + "'" + meant(meantCommand(command, first));
    }
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return message;
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

std::string nearestName(const std::string& typed, const std::vector<std::string>& names) {
    std::string best;
    std::size_t least = std::max<std::size_t>(1, typed.size() / 3) + 1;
    for (const std::string& name : names) {
        const std::size_t distance = editDistance(typed, name);
        if (distance >= least) continue;
        least = distance;
        best = name;
    }
    if (!best.empty() || typed.size() < 3) return best;
    // Only begun, as in --thresh.
    const auto begun = std::find_if(names.begin(), names.end(),
                                    [&](const std::string& name) { return name.rfind(typed, 0) == 0; });
    return begun == names.end() ? std::string() : *begun;
}

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

}  // namespace shapedb::cli
