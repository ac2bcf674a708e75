// SPDX-License-Identifier: GPL-3.0-or-later
// Messages about a wrong command line of shapedbd.
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

}  // namespace shapedb::config
