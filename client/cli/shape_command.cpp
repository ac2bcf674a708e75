// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb get|list|count|watch|signature`: what is stored.
#include <algorithm>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
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
    bool points = false;
    bool preview = false;
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
    if (shape.origin != Point3{}) table.add({"sent relative to", formatPoint(shape.origin)});
    if (shape.quality) table.add({"quality", formatFixed(*shape.quality, 2) + " of 1"});
    for (const auto& [name, value] : shape.metadata) table.add({name, value});
    return table.render();
}

/// --points: writes the scan as it was sent, where it was.
CommandResult writeScan(Session& session, const client::Client& client, const KeyFlags& flags) {
    const auto scan = client.getPoints(flags.shape, session.context());
    RETURN_IF_ERROR(scan);
    // With an origin the coordinates have more digits than single precision.
    const bool moved = scan->shape.origin != Point3{};
    RETURN_IF_ERROR(
        writePointsPly(flags.out, scan->points, moved ? PlyPrecision::kDouble : PlyPrecision::kSingle));
    json document = toJson(scan->shape);
    document["out"] = flags.out;
    session.console().document(document);
    session.console().text(shapeText(scan->shape) + "\nPoints as they were sent: " + inLine(flags.out) +
                           "\n");
    return kOk;
}

/// --preview: writes what pictures are made of.
CommandResult writePreview(Session& session, const client::Client& client, const KeyFlags& flags) {
    const RunContext context = session.context();
    const auto shape = client.getShape(flags.shape, context);
    RETURN_IF_ERROR(shape);
    const auto previews = client.getPreviews(flags.shape.collection, {flags.shape.key}, 0, context);
    RETURN_IF_ERROR(previews);
    if (previews->empty() || previews->front().points.empty()) {
        return fail(ErrorCode::kNotReady, flags.shape.key +
                                              ": it has no surface points to draw, as those of "
                                              "profile paper never have");
    }
    RETURN_IF_ERROR(writePointsPly(flags.out, previews->front().points, PlyPrecision::kSingle));
    json document = toJson(*shape);
    document["out"] = flags.out;
    session.console().document(document);
    session.console().text(shapeText(*shape) + "\n" + formatCount(previews->front().points.size()) +
                           " points about the middle of its box: " + inLine(flags.out) + "\n");
    return kOk;
}

CommandResult runGet(Session& session, const KeyFlags& flags) {
    if ((flags.points || flags.preview) && flags.out.empty()) {
        return fail(ErrorCode::kInvalidArgument, std::string(flags.points ? "--points" : "--preview") +
                                                     " needs --out FILE.ply, the file to write");
    }
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    if (flags.preview) return writePreview(session, *client, flags);
    if (flags.points) return writeScan(session, *client, flags);
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
        text += "\nPoints coloured by part: " + inLine(flags.out) + "\n";
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
    std::string text = inLine(flags.shape.key) + ": volume " + formatNumber(signature->volume) +
                       ", diagonal " + formatNumber(signature->scale) + "\n";
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
    session.leftBehind = "the server goes on with it; the same command follows it again";
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    json events = json::array();
    std::string lastStage;
    const auto last = client->watchIngest(
        flags.shape,
        [&](const client::IngestEvent& event) {
            events.push_back(eventJson(event));
            if (event.state != client::ShapeState::kPending) return;
            if (event.stage != lastStage)
                session.console().text(inLine(flags.shape.key) + ": " + event.stage + "\n");
            lastStage = event.stage;
            session.console().progress(event.stage, event.done, event.total);
        },
        session.context());
    RETURN_IF_ERROR(last);
    json document = eventJson(*last);
    document["key"] = flags.shape.key;
    document["events"] = events;
    session.console().document(document);
    session.console().text(inLine(flags.shape.key) + ": " + client::stateName(last->state) +
                           (last->quality ? ", " + qualityText(*last->quality) : "\n"));
    if (!last->failure) return kOk;
    session.console().note(flags.shape.key + ": " + last->failure->message);
    return exitCodeOf(last->failure->code);
}

struct ListFlags {
    client::ListRequest request;
    std::string state;
    std::string order;
    std::string by;  ///< count: the metadata key whose values are counted
    std::optional<std::uint64_t> limit;
};

/// Names an order, or the reverse of one with a '-' before it.
Result<void> readOrder(const ListFlags& flags, client::ListRequest& request) {
    // Without an order, keys that begin alike are shown in theirs.
    std::string name = !flags.order.empty() ? flags.order : flags.request.keyPrefix.empty() ? "id" : "key";
    request.descending = name.front() == '-';
    if (request.descending) name.erase(0, 1);
    if (name == "id") request.order = client::ShapeOrder::kId;
    if (name == "key") request.order = client::ShapeOrder::kKey;
    if (name == "updated") request.order = client::ShapeOrder::kUpdated;
    if (name == "id" || name == "key" || name == "updated") return {};
    return fail(
        ErrorCode::kInvalidArgument,
        "--order '" + flags.order + "' is not id, key or updated, or one of them with a '-' before it");
}

std::optional<client::ShapeState> stateOf(const std::string& name) {
    if (name == "pending") return client::ShapeState::kPending;
    if (name == "ready") return client::ShapeState::kReady;
    if (name == "failed") return client::ShapeState::kFailed;
    return std::nullopt;
}

/// As many pages as the limit allows. With --json-lines the shapes are printed as they come, and not kept.
Result<client::ListPage> listAll(Session& session, const client::Client& client, const ListFlags& flags) {
    const RunContext context = session.context();
    Console& console = session.console();
    std::uint64_t listed = 0;
    client::ListRequest request = flags.request;
    request.state = stateOf(flags.state);
    RETURN_IF_ERROR(readOrder(flags, request));
    client::ListPage all;
    do {
        const std::uint64_t missing = flags.limit ? *flags.limit - listed : kPageSize;
        request.pageSize = static_cast<std::uint32_t>(std::min<std::uint64_t>(kPageSize, missing));
        auto page = client.listShapes(request, context);
        RETURN_IF_ERROR(page);
        listed += page->shapes.size();
        for (client::Shape& shape : page->shapes) {
            if (console.lines()) {
                console.item(toJson(shape));
            } else {
                all.shapes.push_back(std::move(shape));
            }
        }
        all.nextCursor = page->nextCursor;
        request.cursor = page->nextCursor;
    } while (!all.nextCursor.empty() && (!flags.limit || listed < *flags.limit) && !console.readerLeft());
    return all;
}

CommandResult runList(Session& session, const ListFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto page = listAll(session, *client, flags);
    RETURN_IF_ERROR(page);
    if (session.console().lines()) {
        if (!page->nextCursor.empty()) session.console().item({{"next_cursor", page->nextCursor}});
        return kOk;
    }
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

CommandResult countValues(Session& session, const client::Client& client, const ListFlags& flags) {
    client::ValueCountRequest request;
    request.collection = flags.request.collection;
    request.metadataKey = flags.by;
    request.filter = flags.request.filter;
    request.state = stateOf(flags.state);
    request.maxValues = static_cast<std::uint32_t>(flags.limit.value_or(0));
    const auto counts = client.countByValue(request, session.context());
    RETURN_IF_ERROR(counts);
    json values = json::array();
    Table table({{flags.by}, {"shapes", Table::Align::kRight}});
    for (const client::ValueCount& one : counts->values) {
        values.push_back({{"value", one.value}, {"count", one.shapes}});
        table.add({one.value, formatCount(one.shapes)});
    }
    session.console().document({{"by", flags.by},
                                {"values", values},
                                {"other_values", counts->otherValues},
                                {"other_count", counts->otherShapes},
                                {"without", counts->without}});
    std::string text = table.empty() ? "no shapes with " + flags.by + "\n" : table.render();
    if (counts->otherValues > 0) {
        text += "and " + formatCount(counts->otherValues, "other value", "other values") + ": " +
                formatCount(counts->otherShapes, "shape", "shapes") + "\n";
    }
    if (counts->without > 0) {
        text += formatCount(counts->without, "shape", "shapes") + " without " + flags.by + "\n";
    }
    session.console().text(text);
    return kOk;
}

CommandResult runCount(Session& session, const ListFlags& flags) {
    if (flags.by.empty() && flags.limit) {
        return fail(ErrorCode::kInvalidArgument, "--limit is for --by: how many values to show");
    }
    if (!flags.by.empty() && !flags.request.keyPrefix.empty()) {
        return fail(ErrorCode::kInvalidArgument, "--prefix and --by exclude each other; use --filter");
    }
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    if (!flags.by.empty()) return countValues(session, *client, flags);
    client::ListRequest request = flags.request;
    request.state = stateOf(flags.state);
    const auto count = client->countShapes(request, session.context());
    RETURN_IF_ERROR(count);
    session.console().document({{"count", *count}});
    session.console().text(std::to_string(*count) + "\n");
    return kOk;
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
    command->add_option("--prefix", flags->request.keyPrefix, "Only shapes whose key begins with this");
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return flags;
}

}  // namespace

void addShapeCommands(CLI::App& app, Session& session) {
    const auto get = addKeyCommand(app, session, "get", "Show one stored shape", &runGet);
    app.get_subcommand("get")
        ->add_option("-o,--out", get->out, "Write its points, coloured and labelled by part")
        ->type_name("FILE.ply")
        ->check(endsIn(".ply"));
    app.get_subcommand("get")
        ->add_flag("--points", get->points,
                   "With --out: write the points as they were sent, and nothing else")
        ->excludes(app.get_subcommand("get")->add_flag(
            "--preview", get->preview, "With --out: write the 1,000 points or so that pictures are made of"));
    addKeyCommand(app, session, "signature", "Show what a search compares: parts and statistics of a shape",
                  &runSignature);
    addKeyCommand(app, session, "watch", "Follow a shape until it is segmented", &runWatch);
    const auto list = addListCommand(app, session, "list", "List stored shapes", &runList);
    app.get_subcommand("list")
        ->add_option("--limit", list->limit, "List at most this many [all]")
        ->check(aboveZero());
    app.get_subcommand("list")->add_option("--cursor", list->request.cursor,
                                           "Continue an earlier list --limit");
    app.get_subcommand("list")
        ->add_option("--order", list->order,
                     "Order: id, key or updated (time of change), with a '-' before it the reverse "
                     "[id; with --prefix key]")
        ->type_name("ORDER");
    const auto count = addListCommand(app, session, "count", "Count stored shapes", &runCount);
    app.get_subcommand("count")
        ->add_option("--by", count->by, "Count the shapes of each value of this metadata")
        ->type_name("NAME");
    app.get_subcommand("count")
        ->add_option("--limit", count->limit, "With --by: show at most this many values, up to 1000 [100]")
        ->check(CLI::Range(1, 1000));
}

}  // namespace shapedb::cli
