// The server a command talks to.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/cli/session.h"
#include "core/base/error.h"

namespace shapedb::cli {

/// What a command's calls ask of the server.
enum class Work {
    kLight,  ///< an answer from what it has: a minute is plenty
    kHeavy,  ///< a scan sent and perhaps segmented, a full queue waited for: an hour
};

/// A client for --server. With --timeout the session's context bounds the calls, without it the
/// time that the work may take does. Errors: kInvalidArgument.
[[nodiscard]] Result<client::Client> connectToServer(const Session& session, Work work = Work::kLight);

/// --collection, empty for the default one.
void addCollectionOption(CLI::App& command, std::string& collection);

/// "name=value" pairs as given with --meta. Errors: kInvalidArgument naming the pair.
[[nodiscard]] Result<client::Metadata> parseMetadata(const std::vector<std::string>& pairs);

/// The label of a shape, for tables: its metadata "label", or nothing.
[[nodiscard]] std::string labelOf(const client::Shape& shape);

}  // namespace shapedb::cli
