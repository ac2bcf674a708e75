// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/key_command.h"

#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "common/utc_text.h"
#include "core/base/return_if_error.h"
#include "server/config/command_line.h"
#include "server/config/load.h"
#include "server/daemon.h"
#include "server/security/key.h"

namespace shapedb {
namespace {

constexpr int kFailed = 1;
constexpr int kWrongCommandLine = 2;
constexpr security::UnixMs kDay = 86'400'000;

struct KeyFlags {
    config::CommandLine place;  ///< --data and --config
    std::string data;
    std::string name;
    std::string role;
    std::vector<std::string> collections;
    std::int64_t validDays = 0;
    security::KeyLimits limits;
    std::string id;
};

std::string dateOf(security::UnixMs time) { return utcText(time / 1'000, "%Y-%m-%d %H:%M"); }

std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text.empty() ? "all" : text;
}

std::string stateOf(const security::Key& key, security::UnixMs now) {
    if (key.revoked) return "revoked " + dateOf(*key.revoked);
    if (!key.spec.expires) return "valid";
    return (now < *key.spec.expires ? "until " : "expired ") + dateOf(*key.spec.expires);
}

Result<void> createKey(security::Keyring& keyring, const KeyFlags& flags) {
    const auto role = security::roleFromName(flags.role);
    RETURN_IF_ERROR(role);
    security::KeySpec spec;
    spec.name = flags.name;
    spec.role = *role;
    spec.collections = flags.collections;
    spec.limits = flags.limits;
    if (flags.validDays > 0) spec.expires = keyring.clock().wall() + flags.validDays * kDay;
    const auto created = keyring.create(spec);
    RETURN_IF_ERROR(created);
    std::fprintf(
        stderr,
        "key %s for '%s' (%s). This is the only time it is shown: keep it in a file that only its user can "
        "read.\n",
        created->key.id.c_str(), spec.name.c_str(), security::roleName(spec.role));
    std::printf("%s\n", created->text.c_str());
    return {};
}

Result<void> listKeys(security::Keyring& keyring) {
    const auto keys = keyring.list();
    RETURN_IF_ERROR(keys);
    std::printf("%-16s  %-6s  %-24s  %-24s  %s\n", "ID", "ROLE", "NAME", "STATE", "COLLECTIONS");
    for (const security::KeyStatus& status : *keys) {
        const security::Key& key = status.key;
        std::printf("%-16s  %-6s  %-24s  %-24s  %s\n", key.id.c_str(), security::roleName(key.spec.role),
                    key.spec.name.c_str(), stateOf(key, keyring.clock().wall()).c_str(),
                    joined(key.spec.collections).c_str());
    }
    return {};
}

Result<void> revokeKey(security::Keyring& keyring, const std::string& id) {
    const auto key = keyring.revoke(id);
    RETURN_IF_ERROR(key);
    std::printf("revoked %s ('%s')\n", key->id.c_str(), key->spec.name.c_str());
    return {};
}

Result<std::string> dataDirectoryOf(KeyFlags& flags) {
    if (!flags.data.empty()) flags.place.flags["data"] = flags.data;
    const auto loaded = config::loadEachAlone(flags.place, config::processEnvironment());
    RETURN_IF_ERROR(loaded);
    return loaded->config.data;
}

void addPlace(CLI::App& command, KeyFlags& flags) {
    command.add_option("--data", flags.data, "Data directory of the server, which may be running")
        ->type_name("DIR");
    command
        .add_option("--config", flags.place.configFile, "Configuration file of the server [SHAPEDB_CONFIG]")
        ->type_name("FILE");
}

CLI::App* addCreate(CLI::App& app, KeyFlags& flags) {
    CLI::App* create = app.add_subcommand("create", "Make a key and print it");
    addPlace(*create, flags);
    create->add_option("--name", flags.name, "Whose key it is; several may share a name")->required();
    create->add_option("--role", flags.role, "reader, writer or admin; each includes the ones before it")
        ->required()
        ->type_name("ROLE");
    create
        ->add_option("--collection", flags.collections, "A collection that it may use; repeat for more [all]")
        ->type_name("NAME");
    create->add_option("--valid-days", flags.validDays, "Days until it expires [never]")
        ->check(CLI::Range(1, 36'500));
    create->add_option("--calls-per-second", flags.limits.callsPerSecond, "Most calls a second [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000}));
    create
        ->add_option("--scans-per-day", flags.limits.scansPerDay, "Most scans received a day, UTC [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()));
    create
        ->add_option("--bytes-per-day", flags.limits.bytesPerDay,
                     "Most bytes of points received a day, UTC [no limit]")
        ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()));
    return create;
}

int answer(const Result<void>& result) {
    if (result) return 0;
    std::fprintf(stderr, "shapedbd: %s: %s\n", errorCodeName(result.error().code),
                 result.error().message.c_str());
    return result.error().code == ErrorCode::kInvalidArgument ? kWrongCommandLine : kFailed;
}

}  // namespace

int runKeyCommand(int argc, char** argv) {
    KeyFlags flags;
    CLI::App app("API keys of a server, made on its machine; a running server takes them within a second",
                 "shapedbd key");
    app.require_subcommand(1);
    const CLI::App* create = addCreate(app, flags);
    CLI::App* list = app.add_subcommand("list", "List all keys, without their secrets");
    addPlace(*list, flags);
    CLI::App* revoke = app.add_subcommand("revoke", "Make a key useless");
    addPlace(*revoke, flags);
    revoke->add_option("id", flags.id, "Id of the key, from 'list'")->required()->type_name("ID");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);  // --help
        return answer(fail(ErrorCode::kInvalidArgument,
                           config::commandLineMessage(app, error) + " (see 'shapedbd key --help')"));
    }
    return answer([&]() -> Result<void> {
        const auto data = dataDirectoryOf(flags);
        RETURN_IF_ERROR(data);
        const auto keyring = openKeyring(*data, nullptr);
        RETURN_IF_ERROR(keyring);
        if (create->parsed()) return createKey(**keyring, flags);
        if (list->parsed()) return listKeys(**keyring);
        return revokeKey(**keyring, flags.id);
    }());
}

}  // namespace shapedb
