// SPDX-License-Identifier: GPL-3.0-or-later
// How many files and sockets the process may have open.
#pragma once

#include <cstddef>

namespace shapedb::net {

/// Descriptors that the database, the log and gRPC itself need beside connections.
constexpr std::size_t kReservedDescriptors = 256;

/// Raises the soft limit of this process to its hard limit, and returns it.
std::size_t raiseDescriptorLimit();

/// `wanted` connections, or as many as a limit of `descriptors` has room for beside those that are reserved:
/// at least half of them in any case. For each of `transports` transports, which share the room equally.
[[nodiscard]] std::size_t connectionsWithin(std::size_t descriptors, std::size_t wanted,
                                            std::size_t transports = 1);

}  // namespace shapedb::net
