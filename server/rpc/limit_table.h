// SPDX-License-Identifier: GPL-3.0-or-later
// Every limit that a client can meet, in one table: what ServerInfo lists and docs/limits.md describes. The
// values are the constants and settings by which the limits are enforced; nothing is written twice.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/catalog/limits.h"
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

// Limits of the gRPC transport; server/catalog/limits.h has those of the API.

constexpr int kMaxReceiveBytes = 4 << 20;
/// More than the calls that may run (catalog/limits.h): the rest listen, and refuse calls by name.
constexpr int kMaxCallThreads = 256;
static_assert(config::kMostUploads + catalog::kMaxFollowers < catalog::kMaxOrdinaryCalls);
static_assert(kMaxCallThreads >= catalog::kMaxOrdinaryCalls + catalog::kMaxAdminCalls + 32);
/// Memory that gRPC may use for connections and messages in transit, all together.
constexpr std::size_t kTransportBytes = std::size_t{1} << 30;
constexpr std::size_t kLabelledChunkPoints = 32'768;  ///< in one LabelledChunk
/// Length of an error message: it travels in a header, and headers are small.
constexpr std::size_t kMaxErrorMessageBytes = 2'048;

constexpr std::chrono::milliseconds kKeepaliveTime{60'000};
constexpr std::chrono::milliseconds kKeepaliveTimeout{20'000};
constexpr std::chrono::milliseconds kShortestClientPing{10'000};
/// A connection that says nothing intelligible within this time is closed.
constexpr std::chrono::milliseconds kHandshakeTime{10'000};
constexpr int kMaxStreamsOfConnection = 100;
/// At the Unix socket: administrators and health checks of this machine.
constexpr std::size_t kMaxLocalConnections = 64;

}  // namespace shapedb::rpc
