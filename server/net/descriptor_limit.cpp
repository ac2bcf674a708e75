// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/descriptor_limit.h"

#include <algorithm>

#include <sys/resource.h>

namespace shapedb::net {

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
