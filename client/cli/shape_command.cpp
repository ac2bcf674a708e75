// `shapedb get|list|count|delete|watch|signature`: single stored shapes.
#include <algorithm>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/io/ply_writer.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

/// Shapes per request while listing: the server's limit.
constexpr std::uint32_t kPageSize = 1000;

struct KeyFlags {
    client::ShapeRef shape;
    std::string out;
};

std::string shapeText(const client::Shape& shape) {
    Table table({{""}, {""}});
    table.add({"key", shape.key});
    table.add({"collection", shape.collection});
    table.add({"id", std::to_string(shape.id)});
    table.add({"version", std::to_string(shape.version)});
    table.add({"state", client::stateName(shape.state)});
    if (shape.failure) {
        table.add(
            {"failure", std::string(errorCodeName(shape.failure->code)) + ": " + shape.failure->message});
    }
    table.add({"points", formatCount(shape.pointCount)});
    if (shape.quality) table.add({"quality", formatFixed(*shape.quality, 2) + " of 1"});
    for (const auto& [name, value] : shape.metadata) table.add({name, value});
    return table.render();
}

CommandResult runGet(Session& session, const KeyFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const RunContext context = session.context();
    const auto shape = client->getShape(flags.shape, context);
    RETURN_IF_ERROR(shape);
    json document = toJson(*shape);
    std::string text = shapeText(*shape);
    if (!flags.out.empty()) {
        const auto scan = client->getSegments(flags.shape, context);
        RETURN_IF_ERROR(scan);
        const auto written = writeLabelledPly(flags.out, scan->points, scan->segments);
        RETURN_IF_ERROR(written);
        document["report"] = toJson(scan->report);
        document["signature"] = pointsJson(scan->signature);
        document["out"] = flags.out;
        text += "\nPoints coloured by part: " + flags.out + "\n";
    }
    session.console().document(document);
    session.console().text(text);
    return kOk;
}

CommandResult runSignature(Session& session, const KeyFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto signature = client->getSignature(flags.shape, session.context());
    RETURN_IF_ERROR(signature);
    json document = toJson(*signature);
    document["key"] = flags.shape.key;
    std::string text = flags.shape.key + ": volume " + formatNumber(signature->volume) + ", diagonal " +
                       formatNumber(signature->scale) + "\n";
    if (signature->attributes) {
        document["statistics"] = statisticsJson(*signature);
        text += qualityText(signature->attributes->quality);
    }
    text += "\n" + signatureTable(*signature);
    if (signature->attributes) text += "\n" + statisticsTable(*signature);
    session.console().document(document);
    session.console().text(text);
    return kOk;
}

json eventJson(const client::IngestEvent& event) {
    json document = {{"state", client::stateName(event.state)}};
    if (event.state == client::ShapeState::kPending) {
        document.update({{"stage", event.stage}, {"done", event.done}, {"total", event.total}});
    }
    if (event.failure) document["failure"] = toJson(*event.failure);
    if (event.quality) document["quality"] = *event.quality;
    return document;
}

CommandResult runWatch(Session& session, const KeyFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    json events = json::array();
    std::string lastStage;
    const auto last = client->watchIngest(
        flags.shape,
        [&](const client::IngestEvent& event) {
            events.push_back(eventJson(event));
            if (event.state != client::ShapeState::kPending) return;
            if (event.stage != lastStage) session.console().text(flags.shape.key + ": " + event.stage + "\n");
            lastStage = event.stage;
            session.console().progress(event.stage, event.done, event.total);
        },
        session.context());
    RETURN_IF_ERROR(last);
    json document = eventJson(*last);
    document["key"] = flags.shape.key;
    document["events"] = events;
    session.console().document(document);
    session.console().text(flags.shape.key + ": " + client::stateName(last->state) +
                           (last->quality ? ", " + qualityText(*last->quality) : "\n"));
    if (!last->failure) return kOk;
    session.console().note(flags.shape.key + ": " + last->failure->message);
    return exitCodeOf(last->failure->code);
}

struct ListFlags {
    client::ListRequest request;
    std::string state;
    std::optional<std::uint64_t> limit;
};

std::optional<client::ShapeState> stateOf(const std::string& name) {
    if (name == "pending") return client::ShapeState::kPending;
    if (name == "ready") return client::ShapeState::kReady;
    if (name == "failed") return client::ShapeState::kFailed;
    return std::nullopt;
}

/// As many pages as the limit allows.
Result<client::ListPage> listAll(const client::Client& client, const ListFlags& flags,
                                 const RunContext& context) {
    client::ListRequest request = flags.request;
    request.state = stateOf(flags.state);
    client::ListPage all;
    do {
        const std::uint64_t missing = flags.limit ? *flags.limit - all.shapes.size() : kPageSize;
        request.pageSize = static_cast<std::uint32_t>(std::min<std::uint64_t>(kPageSize, missing));
        auto page = client.listShapes(request, context);
        RETURN_IF_ERROR(page);
        std::move(page->shapes.begin(), page->shapes.end(), std::back_inserter(all.shapes));
        all.nextCursor = page->nextCursor;
        request.cursor = page->nextCursor;
    } while (!all.nextCursor.empty() && (!flags.limit || all.shapes.size() < *flags.limit));
    return all;
}

CommandResult runList(Session& session, const ListFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto page = listAll(*client, flags, session.context());
    RETURN_IF_ERROR(page);
    json shapes = json::array();
    Table table(
        {{"id", Table::Align::kRight}, {"key"}, {"label"}, {"state"}, {"points", Table::Align::kRight}});
    for (const client::Shape& shape : page->shapes) {
        shapes.push_back(toJson(shape));
        table.add({std::to_string(shape.id), shape.key, labelOf(shape), client::stateName(shape.state),
                   formatCount(shape.pointCount)});
    }
    session.console().document({{"shapes", shapes}, {"next_cursor", page->nextCursor}});
    session.console().text(table.empty() ? "no shapes\n" : table.render());
    if (!page->nextCursor.empty()) session.console().text("more: --cursor " + page->nextCursor + "\n");
    return kOk;
}

CommandResult runCount(Session& session, const ListFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    client::ListRequest request = flags.request;
    request.state = stateOf(flags.state);
    const auto count = client->countShapes(request, session.context());
    RETURN_IF_ERROR(count);
    session.console().document({{"count", *count}});
    session.console().text(std::to_string(*count) + "\n");
    return kOk;
}

struct DeleteFlags {
    std::vector<std::string> keys;
    std::string collection;
    std::optional<std::int64_t> expectedVersion;
};

CommandResult runDelete(Session& session, const DeleteFlags& flags) {
    if (flags.expectedVersion && flags.keys.size() != 1) {
        return fail(ErrorCode::kInvalidArgument, "--expected-version applies to one shape; give one key");
    }
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const RunContext context = session.context();
    json deleted = json::array();
    json failed = json::array();
    int last = kOk;
    for (const std::string& key : flags.keys) {
        const auto shape = client->deleteShape({flags.collection, key}, flags.expectedVersion, context);
        if (shape) {
            deleted.push_back(toJson(*shape));
            session.console().text(key + ": deleted\n");
            continue;
        }
        if (flags.keys.size() == 1) return fail(shape.error());
        failed.push_back({{"key", key}, {"error", toJson(shape.error())}});
        session.console().note(key + ": " + shape.error().message);
        last = exitCodeOf(shape.error().code);
        if (last == kUnavailable || last == kInterrupted) break;  // the others would fail too
    }
    session.console().document({{"deleted", deleted}, {"failed", failed}});
    if (failed.empty()) return kOk;
    return last == kUnavailable || last == kInterrupted ? last : static_cast<int>(kSomeFailed);
}

using KeyRunner = CommandResult (*)(Session&, const KeyFlags&);
using ListRunner = CommandResult (*)(Session&, const ListFlags&);

std::shared_ptr<KeyFlags> addKeyCommand(CLI::App& app, Session& session, const char* name, const char* help,
                                        KeyRunner runner) {
    auto flags = std::make_shared<KeyFlags>();
    CLI::App* command = app.add_subcommand(name, help);
    command->add_option("KEY", flags->shape.key, "Key of the shape")->required();
    addCollectionOption(*command, flags->shape.collection);
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return flags;
}

std::shared_ptr<ListFlags> addListCommand(CLI::App& app, Session& session, const char* name, const char* help,
                                          ListRunner runner) {
    auto flags = std::make_shared<ListFlags>();
    CLI::App* command = app.add_subcommand(name, help);
    addCollectionOption(*command, flags->request.collection);
    command->add_option("--filter", flags->request.filter,
                        "Only shapes with such metadata, e.g. 'label=cup'");
    command->add_option("--state", flags->state, "Only shapes in this state")
        ->check(CLI::IsMember({"pending", "ready", "failed"}));
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return flags;
}

}  // namespace

void addShapeCommands(CLI::App& app, Session& session) {
    const auto get = addKeyCommand(app, session, "get", "Show one stored shape", &runGet);
    app.get_subcommand("get")
        ->add_option("--out", get->out, "Write its points, coloured and labelled by part")
        ->type_name("FILE.ply");
    addKeyCommand(app, session, "signature", "Show what a search compares: parts and statistics of a shape",
                  &runSignature);
    addKeyCommand(app, session, "watch", "Follow a shape until it is segmented", &runWatch);
    const auto list = addListCommand(app, session, "list", "List stored shapes", &runList);
    app.get_subcommand("list")
        ->add_option("--limit", list->limit, "List at most this many [all]")
        ->check(aboveZero());
    app.get_subcommand("list")->add_option("--cursor", list->request.cursor,
                                           "Continue an earlier list --limit");
    addListCommand(app, session, "count", "Count stored shapes", &runCount);

    auto flags = std::make_shared<DeleteFlags>();
    CLI::App* command = app.add_subcommand("delete", "Delete stored shapes");
    command->add_option("KEY", flags->keys, "Keys of the shapes")->required();
    addCollectionOption(*command, flags->collection);
    command->add_option("--expected-version", flags->expectedVersion,
                        "Only if the shape has this version now");
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runDelete(session, *flags); }; });
}

}  // namespace shapedb::cli
