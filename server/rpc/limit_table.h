// SPDX-License-Identifier: GPL-3.0-or-later
// Every limit that a client can meet, in one table: what ServerInfo lists and docs/limits.md describes. The
// values are the constants and settings by which the limits are enforced; nothing is written twice.
#pragma once

#include <cstdint>
#include <vector>

#include "server/config/server_config.h"

namespace shapedb::rpc {

struct LimitRow {
    const char* name;     ///< of the setting, or frozen (clients look it up)
    std::uint64_t value;  ///< the largest that is allowed, or the smallest where the name says min
    const char* unit;
    const char* bounds;   ///< what it bounds
    const char* refusal;  ///< name of the error beyond it; empty: none, `bounds` says what happens
};

/// In the order of docs/limits.md, where a test compares it with a server of the default configuration.
[[nodiscard]] std::vector<LimitRow> limitTable(const config::ServerConfig& config);

}  // namespace shapedb::rpc
