// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/connections.h"

#include <algorithm>
#include <optional>

#include <sys/resource.h>
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

std::size_t raiseDescriptorLimit() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1'024;
    rlimit raised = limit;
    raised.rlim_cur = limit.rlim_max;
    if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    return static_cast<std::size_t>(limit.rlim_cur);
}

std::size_t connectionsWithin(std::size_t descriptors, std::size_t wanted, std::size_t transports) {
    const std::size_t beside = descriptors > kReservedDescriptors ? descriptors - kReservedDescriptors : 0;
    return std::min(wanted, std::max(beside, descriptors / 2) / transports);
}

}  // namespace shapedb::net
