// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb collection create|get|list|rename|alias|unalias|delete|export|import`.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/parameters.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct CollectionFlags {
    std::string name;
    std::string other;  ///< the new name, or what an alias stands for
    std::string description;
    ParameterFlags parameters;
    std::string file;
    bool force = false;
};

json collectionJson(const client::Collection& collection) {
    return {{"name", collection.name},
            {"description", collection.description},
            {"aliases", collection.aliases},
            {"generation", collection.generation},
            {"shapes", collection.shapes},
            {"shapes_ready", collection.shapesReady},
            {"shapes_failed", collection.shapesFailed},
            {"damage", collection.damage},
            {"parameters", cli::toJson(collection.parameters)}};
}

std::string collectionsText(const std::vector<client::Collection>& collections) {
    if (collections.empty()) return "no collections\n";
    const auto right = Table::Align::kRight;
    Table table({{"collection"},
                 {"shapes", right},
                 {"ready", right},
                 {"failed", right},
                 {"generation", right},
                 {"profile"},
                 {"unit"},
                 {"aliases"},
                 {"description"}});
    for (const client::Collection& one : collections) {
        std::string aliases;
        for (const std::string& alias : one.aliases) aliases += (aliases.empty() ? "" : ", ") + alias;
        table.add(
            {one.name, formatCount(one.shapes), formatCount(one.shapesReady), formatCount(one.shapesFailed),
             std::to_string(one.generation), profileName(one.parameters.profile.value_or(Profile::kDefault)),
             lengthUnitName(one.parameters.unit.value_or(LengthUnit::kNone)), aliases, one.description});
    }
    std::string text = table.render();
    for (const client::Collection& one : collections) {
        if (!one.damage.empty()) text += one.damage + "\n";
    }
    return text;
}

CommandResult show(Session& session, const Result<client::Collection>& collection) {
    RETURN_IF_ERROR(collection);
    session.console().document(collectionJson(*collection));
    session.console().text(collectionsText({*collection}));
    return kOk;
}

CommandResult runCreate(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    return show(session, client->createCollection(flags.name, flags.description, flags.parameters.given,
                                                  session.context()));
}

CommandResult runGet(Session& session, const CollectionFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    return show(session, client->getCollection(flags.name, session.context()));
}

CommandResult runList(Session& session, const CollectionFlags&) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto collections = client->listCollections(session.context());
    RETURN_IF_ERROR(collections);
    json list = json::array();
    for (const client::Collection& one : *collections) list.push_back(collectionJson(one));
    session.console().document({{"collections", list}});
    session.console().text(collectionsText(*collections));
    return kOk;
}

CommandResult runDelete(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto deleted = client->deleteCollection(flags.name, flags.force, session.context());
    if (!deleted && deleted.error().code == ErrorCode::kRejected && !flags.force) {
        return fail(deleted.error().code, deleted.error().message + ": --force does that");
    }
    RETURN_IF_ERROR(deleted);
    session.console().document({{"deleted", flags.name}});
    session.console().text(inLine(flags.name) + ": deleted\n");
    return kOk;
}

CommandResult runRename(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    return show(session, client->renameCollection(flags.name, flags.other, session.context()));
}

CommandResult runAlias(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto collection = client->setAlias(flags.name, flags.other, session.context());
    RETURN_IF_ERROR(collection);
    session.console().document({{"alias", flags.name}, {"collection", collection->name}});
    session.console().text(inLine(flags.name) + ": stands for " + inLine(collection->name) + "\n");
    return kOk;
}

CommandResult runUnalias(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto deleted = client->deleteAlias(flags.name, session.context());
    RETURN_IF_ERROR(deleted);
    session.console().document({{"deleted", flags.name}});
    session.console().text(inLine(flags.name) + ": no alias any more\n");
    return kOk;
}

CommandResult runExport(Session& session, const CollectionFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto report = client->exportCollection(flags.name, flags.file, session.context());
    RETURN_IF_ERROR(report);
    session.console().document({{"collection", flags.name},
                                {"file", flags.file},
                                {"bytes", report->bytes},
                                {"sha256", toHex(report->sha256.data(), report->sha256.size())}});
    session.console().text(inLine(flags.name) + ": " + formatBytes(report->bytes) + " written to " +
                           inLine(flags.file) + "\n");
    return kOk;
}

CommandResult runImport(Session& session, const CollectionFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto report = client->importCollection(flags.file, flags.name, session.context());
    RETURN_IF_ERROR(report);
    session.console().document({{"collection", report->collection},
                                {"file", flags.file},
                                {"shapes", report->shapes},
                                {"shapes_pending", report->shapesPending}});
    session.console().text(inLine(report->collection) + ": " +
                           formatCount(report->shapes, "shape", "shapes") + " imported from " +
                           inLine(flags.file) +
                           (report->shapesPending > 0
                                ? ", " + formatCount(report->shapesPending) + " of them still to be segmented"
                                : "") +
                           "\n");
    return kOk;
}

using Runner = CommandResult (*)(Session&, const CollectionFlags&);

CLI::App* addOne(CLI::App& group, Session& session, const char* name, const char* help,
                 const std::shared_ptr<CollectionFlags>& flags, Runner runner) {
    CLI::App* command = group.add_subcommand(name, help);
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return command;
}

}  // namespace

void addCollectionCommands(CLI::App& app, Session& session) {
    CLI::App* group =
        app.add_subcommand("collection", "Manage collections: sets of shapes with the same parameters");
    group->require_subcommand(1);
    auto flags = std::make_shared<CollectionFlags>();
    const auto addName = [&](CLI::App* command) {
        command->add_option("NAME", flags->name, "Name of the collection")->required();
    };

    CLI::App* create = addOne(*group, session, "create", "Create a collection", flags, &runCreate);
    addName(create);
    create->add_option("--description", flags->description, "What the collection is for");
    addParameterFlags(*create, flags->parameters);
    addUnitsFlag(*create, flags->parameters);
    addName(addOne(*group, session, "get", "Show one collection", flags, &runGet));
    addOne(*group, session, "list", "List all collections", flags, &runList);
    CLI::App* rename = addOne(*group, session, "rename", "Give a collection another name", flags, &runRename);
    addName(rename);
    rename->add_option("NEW", flags->other, "The new name")->required();
    CLI::App* alias =
        addOne(*group, session, "alias", "Make a name stand for a collection, or for another one than before",
               flags, &runAlias);
    alias->add_option("NAME", flags->name, "The alias")->required();
    alias->add_option("TARGET", flags->other, "The collection")->required();
    CLI::App* unalias =
        addOne(*group, session, "unalias", "Delete an alias; the collection stays", flags, &runUnalias);
    unalias->add_option("NAME", flags->name, "The alias")->required();
    CLI::App* remove = addOne(*group, session, "delete", "Delete a collection", flags, &runDelete);
    addName(remove);
    remove->add_flag("--force", flags->force, "Delete its shapes too");
    CLI::App* exported =
        addOne(*group, session, "export", "Copy one collection to a file", flags, &runExport);
    addName(exported);
    exported->add_option("FILE", flags->file, "File to write")->required();
    CLI::App* imported = addOne(*group, session, "import",
                                "Add the collection in such a file beside the others", flags, &runImport);
    imported->add_option("FILE", flags->file, "File that export wrote")->required();
    imported->add_option("--name", flags->name, "Name that it gets [the one it had]")->type_name("NAME");
}

}  // namespace shapedb::cli
