// SPDX-License-Identifier: GPL-3.0-or-later
// How another transport of this process calls the gRPC handlers.
#pragma once

#include <memory>
#include <string>

namespace grpc {
class Channel;
}

namespace shapedb::rpc {

/// Metadata of a call that comes from inside: the secret that says so, and the address of the real client,
/// which goes into logs. Without the right secret the address means nothing, whoever sends it.
constexpr const char* kInsideKey = "shapedb-inside";
constexpr const char* kPeerKey = "shapedb-peer";

/// For this process only.
struct Inside {
    std::shared_ptr<grpc::Channel> channel;
    std::string secret;  ///< random, of this run; never logged, never sent
};

}  // namespace shapedb::rpc
