// SPDX-License-Identifier: GPL-3.0-or-later
// How many connections are open, found out without the code that serves and closes them, and how many may be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace shapedb::net {

/// Remembers sockets that were handed over. A descriptor that was closed, or is another file by now, no
/// longer counts. Not thread-safe.
class Connections {
  public:
    /// An open socket that is about to be handed over.
    void add(int descriptor);
    /// Forgets those that were closed and returns how many are left.
    std::size_t count();

  private:
    std::map<int, std::uint64_t> sockets_;  ///< descriptor and inode
};

/// Descriptors that the database, the log and gRPC itself need beside connections.
constexpr std::size_t kReservedDescriptors = 256;

/// Raises the soft limit of this process to its hard limit, and returns it.
std::size_t raiseDescriptorLimit();

/// `wanted` connections, or as many as a limit of `descriptors` has room for beside those that are reserved:
/// at least half of them in any case. For each of `transports` transports, which share the room equally.
[[nodiscard]] std::size_t connectionsWithin(std::size_t descriptors, std::size_t wanted,
                                            std::size_t transports = 1);

}  // namespace shapedb::net
