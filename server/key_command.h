// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedbd key`: API keys, made, listed and revoked on the data directory itself. This is how the first
// admin key comes into being, which no network call can make.
#pragma once

namespace shapedb {

/// `argv[0]` is "key". Prints to standard output; returns the exit code: 0, 1 (it failed), 2 (wrong command
/// line).
int runKeyCommand(int argc, char** argv);

}  // namespace shapedb
