// SPDX-License-Identifier: GPL-3.0-or-later
// What the command line says of itself: messages about a wrong one, in terms of commands and flags, and
// manual pages.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
class ParseError;
}  // namespace CLI

namespace shapedb::cli {

/// One line: what is wrong, what was probably meant, and which --help to look at. `app`: the program, as it
/// was left by parsing.
[[nodiscard]] std::string usageMessage(const CLI::App& app, const CLI::ParseError& error);

/// The subcommand that was named, of those below `app`; `app` itself if none was.
[[nodiscard]] const CLI::App& chosenCommand(const CLI::App& app);

/// A message of the server with the names of request fields as the flags of the chosen command:
/// "verify_candidates: 20000 is more than ..." becomes "--candidates: 20000 is more than ...".
[[nodiscard]] std::string inWordsOfFlags(const CLI::App& app, const std::string& message);

/// "shapedb admin key", from the program down.
[[nodiscard]] std::string fullName(const CLI::App& command);

/// Those that are shown in --help; options also of its groups, positional ones too.
[[nodiscard]] std::vector<const CLI::Option*> optionsOf(const CLI::App& command);
[[nodiscard]] std::vector<const CLI::App*> shownCommands(const CLI::App& app);

/// "shapedb-admin-key" for `shapedb admin key`.
[[nodiscard]] std::string manualName(const CLI::App& command);

/// The page of a command, in roff, for section 1. `version`: what --version prints.
[[nodiscard]] std::string manualPage(const CLI::App& command, const std::string& version);

}  // namespace shapedb::cli
