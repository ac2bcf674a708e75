// SPDX-License-Identifier: GPL-3.0-or-later
// Failpoints of the libraries under test (server/store/failpoints.h): counted, and deadly when asked.
#pragma once

#include <map>
#include <set>
#include <string>

namespace shapedb::reliability {

/// The exit code of a process that died at a failpoint.
constexpr int kDiedThere = 77;

/// Thread-safe.
class Failpoints {
  public:
    /// How often each was reached since the last `forget`.
    static std::map<std::string, int> reached();
    static void forget();
    /// The process ends, as when it is killed, when this one is reached for the `time`-th time from now,
    /// from 1.
    static void dieAt(const std::string& name, int time);

    /// The names in the sources of the server.
    static std::set<std::string> inSources();
};

}  // namespace shapedb::reliability
