// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/connection.h"

#include <CLI/CLI.hpp>

namespace shapedb::cli {

namespace {

constexpr std::chrono::hours kHeavyDeadline{1};
/// Retries until the deadline.
constexpr int kPatientAttempts = 1'000'000;

/// Overrides the options with the flags that were given.
void apply(const ServerFlags& flags, client::ClientOptions& options) {
    const auto prefer = [](std::string& value, const std::string& flag) {
        if (!flag.empty()) value = flag;
    };
    prefer(options.address, flags.address);
    if (!flags.keyFile.empty()) options.apiKey.clear();
    prefer(options.apiKeyFile, flags.keyFile);
    prefer(options.tls.caFile, flags.tls.caFile);
    prefer(options.tls.certificateFile, flags.tls.certificateFile);
    prefer(options.tls.keyFile, flags.tls.keyFile);
    prefer(options.tls.serverName, flags.tls.serverName);
    options.tls.enabled = options.tls.enabled || flags.tls.enabled || !flags.tls.caFile.empty();
}

}  // namespace

Result<client::Client> connectToServer(const Session& session, Work work) {
    return connectTo(session, {}, work);
}

Result<client::Client> connectTo(const Session& session, const ServerFlags& server, Work work) {
    client::ClientOptions options = client::optionsFromEnvironment();
    const GlobalOptions& flags = session.options();
    apply({flags.server, flags.keyFile, flags.tls}, options);
    apply(server, options);
    if (work == Work::kHeavy) {
        options.deadline = kHeavyDeadline;
        options.retry.maxQueueAttempts = kPatientAttempts;
    }
    if (session.options().timeoutSeconds) {
        options.deadline = std::chrono::milliseconds(0);
        // A user who sets a timeout wants retries until it passes.
        options.retry.maxAttempts = kPatientAttempts;
        options.retry.maxQueueAttempts = kPatientAttempts;
    }
    return client::Client::connect(std::move(options));
}

void addCollectionOption(CLI::App& command, std::string& collection) {
    command.add_option("--collection", collection, "Collection to use [default]")->type_name("NAME");
}

Result<client::Metadata> parseMetadata(const std::vector<std::string>& pairs, const char* flag) {
    client::Metadata metadata;
    for (const std::string& pair : pairs) {
        const std::size_t equals = pair.find('=');
        if (equals == std::string::npos || equals == 0) {
            return fail(ErrorCode::kInvalidArgument, std::string(flag) + " '" + pair + "' is not NAME=VALUE");
        }
        const std::string name = pair.substr(0, equals);
        if (!metadata.emplace(name, pair.substr(equals + 1)).second) {
            return fail(ErrorCode::kInvalidArgument, std::string(flag) + " gives '" + name + "' twice");
        }
    }
    return metadata;
}

std::string labelOf(const client::Shape& shape) {
    const auto found = shape.metadata.find("label");
    return found == shape.metadata.end() ? std::string() : found->second;
}

}  // namespace shapedb::cli
