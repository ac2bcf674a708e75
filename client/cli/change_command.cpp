// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb delete|metadata|retry`: changes of stored shapes.
#include <algorithm>
#include <functional>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/failures.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

/// Keys of one request: the server's limit.
constexpr std::size_t kKeysPerRequest = 1000;

/// Which shapes a command is about.
struct TargetFlags {
    std::vector<std::string> keys;
    std::string collection;
    std::optional<std::string> filter;
    std::optional<std::int64_t> expectedVersion;
    bool yes = false;
};

struct MetadataFlags : TargetFlags {
    std::vector<std::string> set;
    std::vector<std::string> remove;
    bool replaceAll = false;
};

tl::unexpected<Error> wrongUsage(const std::string& message) {
    return fail(ErrorCode::kInvalidArgument, message);
}

Result<void> checkTarget(const TargetFlags& flags, bool neitherIsFine = false) {
    if (!flags.keys.empty() && flags.filter) return wrongUsage("give either keys or --filter, not both");
    if (flags.keys.empty() && !flags.filter && !neitherIsFine) {
        return wrongUsage("give the keys of the shapes, or --filter ('': all shapes)");
    }
    if (flags.expectedVersion && flags.keys.size() != 1) {
        return wrongUsage("--expected-version applies to one shape; give one key");
    }
    return {};
}

/// What cannot be undone is done to the shapes of a filter only with --yes. Errors: kRejected, saying how
/// many there are.
Result<void> requireYes(const client::Client& client, const TargetFlags& flags, const char* does,
                        const RunContext& context) {
    if (flags.yes) return {};
    client::ListRequest request;
    request.collection = flags.collection;
    request.filter = *flags.filter;
    const auto count = client.countShapes(request, context);
    RETURN_IF_ERROR(count);
    return fail(ErrorCode::kRejected, formatCount(*count, "shape passes", "shapes pass") +
                                          " the filter; --yes " + does + (*count == 1 ? " it" : " them"));
}

/// Calls `change` for one key after the other, and goes on after an error. `change` returns the text that is
/// printed after the key. Fills `failed`; returns the exit code.
CommandResult forEachKey(Session& session, const client::Client& client, const TargetFlags& flags,
                         json& failed,
                         const std::function<Result<std::string>(const client::ShapeRef&)>& change) {
    // Checked first, so that a wrong collection is reported once and not for every key.
    if (flags.keys.size() > 1) RETURN_IF_ERROR(client.getCollection(flags.collection, session.context()));
    Failures failures;
    std::optional<Error> stop;
    std::size_t seen = 0;
    for (const std::string& key : flags.keys) {
        ++seen;
        const auto done = change({flags.collection, key});
        if (done) {
            session.console().text(inLine(key) + ": " + *done + "\n");
            continue;
        }
        if (flags.keys.size() == 1) return fail(done.error());
        failed.push_back({{"key", key}, {"error", toJson(done.error())}});
        if (session.interrupted() && done.error().code == ErrorCode::kCancelled) {
            failures.tell(session.console(), flags.keys.size(), "key", "keys");
            session.console().note("interrupted at " + key + ": " + kPerhapsChanged + "; " +
                                   formatCount(flags.keys.size() - seen) + " after it were not touched");
            return kInterrupted;
        }
        failures.add(key, done.error());
        if (endsTheCommand(done.error())) {
            stop = done.error();
            break;
        }
    }
    failures.tell(session.console(), flags.keys.size(), "key", "keys");
    return stop ? static_cast<int>(exitCodeOf(stop->code)) : failures.exitCode(flags.keys.size());
}

CommandResult runDelete(Session& session, const TargetFlags& flags) {
    session.leftBehind = !flags.filter ? kPerhapsChanged : "what was deleted before stays deleted";
    RETURN_IF_ERROR(checkTarget(flags));
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const RunContext context = session.context();
    if (flags.filter) {
        RETURN_IF_ERROR(requireYes(*client, flags, "deletes", context));
        const auto reply = client->deleteShapes({flags.collection, {}, flags.filter}, context);
        RETURN_IF_ERROR(reply);
        session.console().document({{"count", reply->deleted}});
        session.console().text(formatCount(reply->deleted, "shape", "shapes") + " deleted\n");
        return kOk;
    }
    json deleted = json::array();
    json failed = json::array();
    const auto code =
        forEachKey(session, *client, flags, failed, [&](const client::ShapeRef& ref) -> Result<std::string> {
            const auto shape = client->deleteShape(ref, flags.expectedVersion, context);
            RETURN_IF_ERROR(shape);
            deleted.push_back(toJson(*shape));
            return std::string("deleted");
        });
    RETURN_IF_ERROR(code);
    session.console().document({{"count", deleted.size()}, {"deleted", deleted}, {"failed", failed}});
    return code;
}

Result<client::MetadataChange> changeOf(const MetadataFlags& flags) {
    client::MetadataChange change;
    auto set = parseMetadata(flags.set, "--set");
    RETURN_IF_ERROR(set);
    change.set = std::move(*set);
    change.remove = flags.remove;
    change.replaceAll = flags.replaceAll;
    if (change.set.empty() && change.remove.empty() && !change.replaceAll) {
        return wrongUsage("nothing to change: give --set, --remove or --replace-all");
    }
    return change;
}

CommandResult changeWhere(Session& session, const client::Client& client, const MetadataFlags& flags,
                          const client::MetadataChange& change) {
    const RunContext context = session.context();
    if (change.replaceAll) RETURN_IF_ERROR(requireYes(client, flags, "replaces all metadata of", context));
    const auto reply = client.updateMetadataWhere(flags.collection, *flags.filter, change, context);
    RETURN_IF_ERROR(reply);
    json document = {
        {"changed", reply->changed}, {"unchanged", reply->unchanged}, {"refused", reply->refused}};
    std::string text = formatCount(reply->changed, "shape", "shapes") + " changed";
    if (reply->unchanged > 0) text += ", " + formatCount(reply->unchanged) + " had this metadata before";
    session.console().text(text + "\n");
    if (reply->firstRefused) {
        document["first_refused"] = {{"key", reply->firstRefusedKey},
                                     {"error", toJson(*reply->firstRefused)}};
        session.console().note(formatCount(reply->refused, "shape", "shapes") +
                               " left unchanged, the first " + reply->firstRefusedKey + ": " +
                               reply->firstRefused->message);
    }
    session.console().document(document);
    return reply->refused > 0 ? static_cast<int>(kSomeFailed) : kOk;
}

CommandResult runMetadata(Session& session, const MetadataFlags& flags) {
    session.leftBehind = !flags.filter ? kPerhapsChanged : "what was changed before stays changed";
    RETURN_IF_ERROR(checkTarget(flags));
    const auto change = changeOf(flags);
    RETURN_IF_ERROR(change);
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    if (flags.filter) return changeWhere(session, *client, flags, *change);
    const RunContext context = session.context();
    json shapes = json::array();
    json failed = json::array();
    std::uint64_t changed = 0;
    const auto code =
        forEachKey(session, *client, flags, failed, [&](const client::ShapeRef& ref) -> Result<std::string> {
            const auto reply = client->updateMetadata(ref, *change, flags.expectedVersion, context);
            RETURN_IF_ERROR(reply);
            changed += reply->changed;
            if (reply->shape) shapes.push_back(toJson(*reply->shape));
            return std::string(reply->changed > 0 ? "changed" : "unchanged");
        });
    RETURN_IF_ERROR(code);
    session.console().document({{"changed", changed},
                                {"unchanged", shapes.size() - changed},
                                {"shapes", shapes},
                                {"failed", failed}});
    return code;
}

Result<client::RetryReply> retry(const client::Client& client, const TargetFlags& flags,
                                 const RunContext& context) {
    if (flags.keys.empty()) {
        return client.retryShapes({flags.collection, {}, flags.filter.value_or(std::string())}, context);
    }
    client::RetryReply all;
    for (std::size_t at = 0; at < flags.keys.size(); at += kKeysPerRequest) {
        const auto begin = flags.keys.begin() + static_cast<std::ptrdiff_t>(at);
        const auto end =
            begin + static_cast<std::ptrdiff_t>(std::min(kKeysPerRequest, flags.keys.size() - at));
        const auto reply = client.retryShapes({flags.collection, {begin, end}, std::nullopt}, context);
        RETURN_IF_ERROR(reply);
        all.queued += reply->queued;
        all.left += reply->left;
        all.notFailed.insert(all.notFailed.end(), reply->notFailed.begin(), reply->notFailed.end());
        all.missing.insert(all.missing.end(), reply->missing.begin(), reply->missing.end());
    }
    return all;
}

CommandResult runRetry(Session& session, const TargetFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    RETURN_IF_ERROR(checkTarget(flags, true));
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto reply = retry(*client, flags, session.context());
    RETURN_IF_ERROR(reply);
    session.console().document({{"queued", reply->queued},
                                {"left", reply->left},
                                {"not_failed", reply->notFailed},
                                {"missing", reply->missing}});
    session.console().text(formatCount(reply->queued, "scan", "scans") + " queued again\n");
    for (const std::string& key : reply->notFailed)
        session.console().text(inLine(key) + ": had not failed\n");
    for (const std::string& key : reply->missing) session.console().note(key + ": there is no such shape");
    if (reply->left > 0) {
        session.console().note("the ingest queue has no room for " + formatCount(reply->left) +
                               " more: try again later");
    }
    if (reply->missing.empty() && reply->left == 0) return kOk;
    return flags.keys.size() == 1 && reply->left == 0 ? kWrongState : static_cast<int>(kSomeFailed);
}

template <typename Flags>
CLI::App* addOne(CLI::App& app, Session& session, const char* name, const char* help,
                 const std::shared_ptr<Flags>& flags, CommandResult (*runner)(Session&, const Flags&)) {
    CLI::App* command = app.add_subcommand(name, help);
    command->add_option("KEY", flags->keys, "Keys of the shapes");
    addCollectionOption(*command, flags->collection);
    command->add_option("--filter", flags->filter,
                        "All shapes with such metadata, e.g. 'label=cup'; '': all");
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return command;
}

void addExpectedVersion(CLI::App& command, TargetFlags& flags) {
    command.add_option("--expected-version", flags.expectedVersion, "Only if the shape has this version now");
}

}  // namespace

void addChangeCommands(CLI::App& app, Session& session) {
    const auto remove = std::make_shared<TargetFlags>();
    CLI::App* command = addOne(app, session, "delete", "Delete stored shapes", remove, &runDelete);
    addExpectedVersion(*command, *remove);
    command->add_flag("--yes", remove->yes, "Delete the shapes of --filter without asking back");

    const auto metadata = std::make_shared<MetadataFlags>();
    command =
        addOne(app, session, "metadata", "Change the metadata of stored shapes", metadata, &runMetadata);
    addExpectedVersion(*command, *metadata);
    command->add_option("--set", metadata->set, "Give the shapes this; may be repeated")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    command->add_option("--remove", metadata->remove, "Take this from the shapes; may be repeated")
        ->type_name("NAME")
        ->allow_extra_args(false);
    command->add_flag("--replace-all", metadata->replaceAll,
                      "Leave the shapes only what --set gives them, with --filter only with --yes");
    command->add_flag("--yes", metadata->yes, "Replace the metadata of the shapes of --filter");

    const auto retried = std::make_shared<TargetFlags>();
    addOne(app, session, "retry",
           "Try again to segment shapes that failed: these, those that match --filter, or all", retried,
           &runRetry);
}

}  // namespace shapedb::cli
