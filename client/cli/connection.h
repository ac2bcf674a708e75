// The server a command talks to.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/cli/session.h"
#include "core/base/error.h"

namespace shapedb::cli {

/// How long a full ingest queue is waited for, in tries; the server says how long each.
constexpr int kPatientAttempts = 1000;

/// A client for --server. With --timeout the session's context bounds the calls, without it the
/// client's own deadline does. Errors: kInvalidArgument.
[[nodiscard]] Result<client::Client> connectToServer(const Session& session,
                                                     int maxAttempts = client::RetryPolicy{}.maxAttempts);

/// --collection, empty for the default one.
void addCollectionOption(CLI::App& command, std::string& collection);

/// "name=value" pairs as given with --meta. Errors: kInvalidArgument naming the pair.
[[nodiscard]] Result<client::Metadata> parseMetadata(const std::vector<std::string>& pairs);

/// The label of a shape, for tables: its metadata "label", or nothing.
[[nodiscard]] std::string labelOf(const client::Shape& shape);

}  // namespace shapedb::cli
