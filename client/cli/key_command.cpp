// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin key create|list|revoke`.
#include <chrono>
#include <limits>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct KeyFlags {
    client::KeyRequest request;
    std::string role;
    int validDays = 0;
    std::string id;
};

const std::map<std::string, client::Role>& roles() {
    static const std::map<std::string, client::Role> all = {{"reader", client::Role::kReader},
                                                            {"writer", client::Role::kWriter},
                                                            {"admin", client::Role::kAdmin}};
    return all;
}

std::string nameOf(client::Role role) {
    for (const auto& [name, value] : roles()) {
        if (value == role) return name;
    }
    return "reader";
}

json timeOrNull(const std::optional<client::Timestamp>& time) {
    return time ? json(timeText(*time)) : json(nullptr);
}

json keyJson(const client::Key& key) {
    return {{"id", key.id},
            {"name", key.name},
            {"role", nameOf(key.role)},
            {"collections", key.collections},
            {"calls_per_second", key.limits.callsPerSecond},
            {"scans_per_day", key.limits.scansPerDay},
            {"bytes_per_day", key.limits.bytesPerDay},
            {"created", timeText(key.created)},
            {"expires", timeOrNull(key.expires)},
            {"revoked", timeOrNull(key.revoked)},
            {"scans_today", key.scansToday},
            {"bytes_today", key.bytesToday}};
}

std::string stateText(const client::Key& key) {
    if (key.revoked) return "revoked " + timeText(*key.revoked);
    if (!key.expires) return "valid";
    const bool valid = client::currentTime() < *key.expires;
    return (valid ? "until " : "expired ") + timeText(*key.expires);
}

std::string collectionsOf(const client::Key& key) {
    std::string text;
    for (const std::string& name : key.collections) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "all" : text;
}

/// "12 of 100", or "12" without a limit.
std::string used(std::uint64_t amount, std::uint64_t limit, std::string (*format)(std::uint64_t)) {
    return format(amount) + (limit > 0 ? " of " + format(limit) : "");
}

std::string keysText(const std::vector<client::Key>& keys) {
    if (keys.empty()) return "no keys\n";
    const auto count = [](std::uint64_t n) { return formatCount(n); };
    Table table({{"id"}, {"role"}, {"name"}, {"state"}, {"collections"}, {"scans today"}, {"bytes today"}});
    for (const client::Key& key : keys) {
        table.add(
            {key.id, nameOf(key.role), key.name, stateText(key), collectionsOf(key),
             used(key.scansToday, key.limits.scansPerDay, count),
             used(key.bytesToday, key.limits.bytesPerDay, [](std::uint64_t n) { return formatBytes(n); })});
    }
    return table.render();
}

CommandResult runCreateKey(Session& session, KeyFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    flags.request.role = roles().at(flags.role);
    if (flags.validDays > 0) {
        flags.request.expires = client::currentTime() + std::chrono::hours(24) * flags.validDays;
    }
    const auto created = client->createKey(flags.request, session.context());
    RETURN_IF_ERROR(created);
    json document = keyJson(created->key);
    document["secret"] = created->secret;
    session.console().document(document);
    session.console().note(
        "key " + created->key.id +
        ". This is the only time it is shown: keep it in a file that only its user can read.");
    session.console().text(created->secret + "\n");
    return kOk;
}

CommandResult runListKeys(Session& session, KeyFlags&) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto keys = client->listKeys(session.context());
    RETURN_IF_ERROR(keys);
    json all = json::array();
    for (const client::Key& key : *keys) all.push_back(keyJson(key));
    session.console().document({{"keys", all}});
    session.console().text(keysText(*keys));
    return kOk;
}

CommandResult runRevokeKey(Session& session, KeyFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto key = client->revokeKey(flags.id, session.context());
    RETURN_IF_ERROR(key);
    session.console().document(keyJson(*key));
    session.console().text(keysText({*key}));
    return kOk;
}

CLI::App* addOne(CLI::App& group, Session& session, const char* name, const char* help,
                 const std::shared_ptr<KeyFlags>& flags, CommandResult (*runner)(Session&, KeyFlags&)) {
    CLI::App* command = group.add_subcommand(name, help);
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return command;
}

void addCreateFlags(CLI::App& create, const std::shared_ptr<KeyFlags>& flags) {
    std::vector<std::string> names;
    for (const auto& [name, role] : roles()) names.push_back(name);
    create.add_option("--name", flags->request.name, "Whose key it is; several may share a name")->required();
    create
        .add_option("--role", flags->role,
                    "reader: search; writer: also add, change, delete shapes; admin: all")
        ->required()
        ->check(CLI::IsMember(names))
        ->type_name("ROLE");
    create
        .add_option("--collection", flags->request.collections,
                    "A collection that it may use; repeat for more [all]")
        ->type_name("NAME");
    create.add_option("--valid-days", flags->validDays, "Days until it expires [never]")
        ->check(CLI::Range(1, 36'500));
    create
        .add_option("--calls-per-second", flags->request.limits.callsPerSecond,
                    "Most calls a second [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000}));
    create
        .add_option("--scans-per-day", flags->request.limits.scansPerDay,
                    "Most scans received a day, UTC [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()));
    create
        .add_option("--bytes-per-day", flags->request.limits.bytesPerDay,
                    "Most bytes of points received a day, UTC [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()));
}

}  // namespace

void addKeyCommands(CLI::App& admin, Session& session) {
    CLI::App* group = admin.add_subcommand(
        "key", "API keys; the first one is made on the server's machine with 'shapedbd key create'");
    group->require_subcommand(1);
    const auto flags = std::make_shared<KeyFlags>();
    addCreateFlags(*addOne(*group, session, "create", "Make a key and print it", flags, &runCreateKey),
                   flags);
    addOne(*group, session, "list", "List all keys, without their secrets", flags, &runListKeys);
    addOne(*group, session, "revoke", "Make a key useless", flags, &runRevokeKey)
        ->add_option("ID", flags->id, "Id of the key, from 'list'")
        ->required();
}

}  // namespace shapedb::cli
