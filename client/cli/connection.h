// SPDX-License-Identifier: GPL-3.0-or-later
// The server that a command talks to.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/cli/session.h"
#include "core/base/error.h"

namespace shapedb::cli {

/// How much a command asks of the server, which decides how long a call may take.
enum class Work {
    kLight,  ///< a minute
    kHeavy,  ///< an hour: scans are sent and segmented, a full queue is waited for
};

/// A client for --server, with the API key and TLS of the flags or the environment. With --timeout the
/// session's context limits the calls instead of `work`. Errors: kInvalidArgument.
[[nodiscard]] Result<client::Client> connectToServer(const Session& session, Work work = Work::kLight);

/// What one of two servers has in place of the options of every command.
struct ServerFlags {
    std::string address;
    std::string keyFile;
    client::TlsOptions tls;
};

/// The same for this server; what is empty is as for connectToServer.
[[nodiscard]] Result<client::Client> connectTo(const Session& session, const ServerFlags& server,
                                               Work work = Work::kLight);

/// --collection; empty for the default one.
void addCollectionOption(CLI::App& command, std::string& collection);

/// The NAME=VALUE pairs of a flag. Errors: kInvalidArgument naming the pair.
[[nodiscard]] Result<client::Metadata> parseMetadata(const std::vector<std::string>& pairs, const char* flag);

/// The metadata "label" of a shape; empty if there is none.
[[nodiscard]] std::string labelOf(const client::Shape& shape);

}  // namespace shapedb::cli
