// SPDX-License-Identifier: Apache-2.0
// Who the client is, and how the connection is protected. Private to client/api.
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

}  // namespace shapedb::client
