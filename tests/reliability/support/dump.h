// SPDX-License-Identifier: GPL-3.0-or-later
// Everything in a database as text, to compare two states of it.
#pragma once

#include <string>

namespace shapedb::reliability {

/// All rows of all tables of the file, in order, long values as hashes; "cannot read: ..." when it cannot be
/// read. The file may be open.
[[nodiscard]] std::string dumpDatabase(const std::string& path);

/// The first line in which two dumps differ, for messages.
[[nodiscard]] std::string differenceOf(const std::string& actual, const std::string& expected);

}  // namespace shapedb::reliability
