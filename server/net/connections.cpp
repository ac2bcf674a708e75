// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/connections.h"

#include <optional>

#include <sys/stat.h>

namespace shapedb::net {

namespace {

/// Each socket has an inode of its own, so that one that took a number again is told from the old one.
std::optional<std::uint64_t> socketInode(int descriptor) {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0 || !S_ISSOCK(status.st_mode)) return std::nullopt;
    return status.st_ino;
}

}  // namespace

void Connections::add(int descriptor) {
    if (const auto inode = socketInode(descriptor)) sockets_[descriptor] = *inode;
}

std::size_t Connections::count() {
    for (auto at = sockets_.begin(); at != sockets_.end();) {
        at = socketInode(at->first) == at->second ? std::next(at) : sockets_.erase(at);
    }
    return sockets_.size();
}

}  // namespace shapedb::net
