// SPDX-License-Identifier: GPL-3.0-or-later
// What shapedbd says of its command line: messages about a wrong one, and the manual page.
#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace shapedb::config {

/// One line: what is wrong, and of an unknown flag or command what was probably meant. `app`: as it was left
/// by parsing.
[[nodiscard]] std::string commandLineMessage(const CLI::App& app, const CLI::ParseError& error);

/// shapedbd(8) as input of man(1), with every setting of settings().
[[nodiscard]] std::string manPage();

}  // namespace shapedb::config
