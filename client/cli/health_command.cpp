// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb health`: is the server serving? Made for container health checks.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/session.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// A server that takes longer is not healthy, unless --timeout allows it.
constexpr double kPatienceSeconds = 5.0;

const char* healthName(client::Health health) {
    switch (health) {
        case client::Health::kServing: return "SERVING";
        case client::Health::kNotServing: return "NOT_SERVING";
        case client::Health::kUnknown: return "UNKNOWN";
    }
    return "UNKNOWN";
}

CommandResult runHealth(Session& session, const std::string& service) {
    if (!session.options().timeoutSeconds) session.options().timeoutSeconds = kPatienceSeconds;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto health = client->health(service, session.context());
    RETURN_IF_ERROR(health);
    session.console().document(
        {{"server", client->address()}, {"service", service}, {"status", healthName(*health)}});
    session.console().text(client->address() + (service.empty() ? "" : " " + service) + ": " +
                           healthName(*health) + "\n");
    return *health == client::Health::kServing ? kOk : kUnavailable;
}

}  // namespace

void addHealthCommand(CLI::App& app, Session& session) {
    auto service = std::make_shared<std::string>();
    CLI::App* command =
        app.add_subcommand("health", "Check that the server is serving (then the exit code is 0)");
    command->add_option("--service", *service,
                        "Only this service, by its full name, e.g. shapedb.v1.SearchService");
    command->callback([&session, service] {
        session.action = [&session, service] { return runHealth(session, *service); };
    });
}

}  // namespace shapedb::cli
