// `shapedb health`: whether the server serves; made for the health check of a container.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/session.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// A server that takes longer than this to say that it is well is not, unless --timeout says so.
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
        app.add_subcommand("health", "Ask whether the server serves; exit code 0 only if it does");
    command->add_option("--service", *service, "Full name of one service, e.g. shapedb.v1.SearchService");
    command->callback([&session, service] {
        session.action = [&session, service] { return runHealth(session, *service); };
    });
}

}  // namespace shapedb::cli
