// SPDX-License-Identifier: Apache-2.0
// Where the client connects to, who it is, and how the connection is protected. Private to client/api.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include "client/api/client.h"
#include "core/base/error.h"

namespace shapedb::client {

/// Whether `address`, which names its port or scheme, is on this machine. Names are not resolved.
[[nodiscard]] bool isThisMachine(const std::string& address);

/// The API key of the options; empty: none. Errors: kFileNotReadable, kInvalidArgument (an empty file; the
/// key would be sent unprotected).
[[nodiscard]] Result<std::string> apiKeyOf(const ClientOptions& options);

/// Also sets what TLS needs in `arguments`. Errors: kFileNotReadable, kInvalidArgument (a certificate without
/// key, or files although TLS is off).
[[nodiscard]] Result<std::shared_ptr<grpc::ChannelCredentials>> channelCredentials(
    const TlsOptions& tls, grpc::ChannelArguments& arguments);

/// "localhost" -> "localhost:7878", "::1" -> "[::1]:7878". Addresses with a port, and those that gRPC has a
/// scheme for ("unix:/path", "dns:///host:1"), stay as they are. Checked before
/// anybody connects: gRPC would take a slip for a host that cannot be found.
/// client/python/src/shapedb/_address.py has the same rules.
///
/// Errors: kInvalidArgument (a web address, no host, a port that is none, words of other schemes), saying
/// what to give instead.
[[nodiscard]] Result<std::string> checkedAddress(const std::string& address);

}  // namespace shapedb::client
