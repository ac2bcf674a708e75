// SPDX-License-Identifier: GPL-3.0-or-later
// How many connections are open, found out without the code that serves and closes them.
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

}  // namespace shapedb::net
