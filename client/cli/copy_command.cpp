// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin copy`: everything from one server to another, while the first is in use.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/copy_run.h"
#include "client/cli/copy_verify.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

using Clock = std::chrono::steady_clock;

/// Between passes that found nothing.
constexpr std::chrono::milliseconds kCopyPause{1000};
/// While nothing changes every key is compared this often, and for a twentieth of the time at most.
constexpr std::chrono::minutes kWholeInterval{10};
constexpr int kWholeShare = 20;
/// How long a server may be away before the command ends.
constexpr std::chrono::minutes kCopyPatience{10};

struct CopyFlags {
    ServerFlags from;
    ServerFlags to;
    bool force = false;
    bool resume = false;
    bool once = false;
    bool verify = false;
    unsigned jobs = 4;
};

CopyCounts totalOf(const CopyCounts& all, const CopyCounts& more) {
    CopyCounts total = all;
    total += more;
    return total;
}

json countsJson(const CopyCounts& counts) {
    return {{"added", counts.added},
            {"replaced", counts.replaced},
            {"metadata_changed", counts.metadataChanged},
            {"deleted", counts.deleted},
            {"collections_changed", counts.collections}};
}

/// "3 added, 1 deleted"; "nothing".
std::string countsText(const CopyCounts& counts) {
    std::string text;
    const auto tell = [&](std::uint64_t count, const std::string& words) {
        if (count > 0) text += (text.empty() ? "" : ", ") + formatCount(count) + " " + words;
    };
    tell(counts.added, "added");
    tell(counts.replaced, "replaced");
    tell(counts.metadataChanged, "with other metadata");
    tell(counts.deleted, "deleted");
    tell(counts.collections, counts.collections == 1 ? "change of collections" : "changes of collections");
    return text.empty() ? "nothing" : text;
}

/// One run of the command that copies.
class Copying {
  public:
    Copying(Session& session, const CopyFlags& flags, const CopySides& sides)
        : session_(session),
          flags_(flags),
          sides_(sides),
          context_(quiet(session.context())),
          run_(sides, flags.jobs, context_,
               [&session](const std::string& what, std::uint64_t done, std::uint64_t total) {
                   session.console().progress(what, done, total);
               }) {}

    CommandResult operator()() {
        if (!flags_.resume) RETURN_IF_ERROR(copyEverything());
        session_.leftBehind = "a part of what changed may be missing there; --continue goes on";
        const Result<void> followed = follow();
        const bool ended = !followed && session_.interrupted() && alike_;
        if (!followed && !ended) return fail(followed.error());
        tellEnd();
        return run_.refusals() > 0 ? kSomeFailed : kOk;
    }

  private:
    static RunContext quiet(RunContext context) {
        context.progress = nullptr;  // progress counts shapes
        return context;
    }

    Result<void> copyEverything() {
        if (!flags_.force) RETURN_IF_ERROR(requireEmpty());
        session_.leftBehind = "the other server is either unchanged or fully restored; copy again";
        const auto restored = sides_.from.copyEverything(sides_.to, session_.context());
        RETURN_IF_ERROR(restored);
        restored_ = *restored;
        session_.console().item({{"restored", restoredJson()}});
        session_.console().text(formatCount(restored->shapes, "shape", "shapes") + " in " +
                                formatCount(restored->collections, "collection", "collections") +
                                " copied from " + sides_.from.address() + " to " + sides_.to.address() +
                                "\n");
        return {};
    }

    Result<void> requireEmpty() {
        const auto stats = sides_.to.stats(context_);
        RETURN_IF_ERROR(stats);
        const std::uint64_t shapes = stats->shapesPending + stats->shapesReady + stats->shapesFailed;
        if (shapes == 0) return {};
        return fail(ErrorCode::kRejected,
                    sides_.to.address() + " has " + formatCount(shapes, "shape", "shapes") +
                        ": --continue copies what differs and deletes what is not on " +
                        sides_.from.address() + ", --force replaces everything at once");
    }

    /// Until Ctrl-C; with --once until the two are alike.
    Result<void> follow() {
        bool whole = true;
        auto nextWhole = Clock::now();
        auto lastAnswer = Clock::now();
        while (true) {
            const auto begun = Clock::now();
            const auto pass = run_.pass(whole);
            if (!pass && pass.error().code == ErrorCode::kUnavailable &&
                Clock::now() - lastAnswer < kCopyPatience) {
                if (!away_) session_.console().note(pass.error().message + "; trying again");
                away_ = true;
                alike_ = false;
                RETURN_IF_ERROR(pause());
                continue;
            }
            RETURN_IF_ERROR(pass);
            away_ = false;
            lastAnswer = Clock::now();
            tell(*pass, lastAnswer - begun);
            if (flags_.once && pass->clean) return {};
            if (pass->whole) {
                nextWhole = lastAnswer +
                            std::max<Clock::duration>(kWholeInterval, kWholeShare * (lastAnswer - begun));
            }
            if (pass->counts.all() == 0) RETURN_IF_ERROR(pause());
            whole = Clock::now() >= nextWhole;
        }
    }

    Result<void> pause() const {
        const auto until = Clock::now() + kCopyPause;
        while (Clock::now() < until) {
            RETURN_IF_ERROR(context_.checkpoint());
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        return {};
    }

    void tell(const CopyPass& pass, Clock::duration took) {
        Console& console = session_.console();
        ++passes_;
        counts_ = totalOf(counts_, pass.counts);
        for (const CopyRefusal& one : pass.refused) {
            refused_.push_back({{"what", one.what}, {"error", toJson(one.error)}});
            console.note(one.what + ": " + one.error.message);
        }
        const bool news = pass.clean != alike_;
        alike_ = pass.clean;
        if (pass.counts.all() == 0 && !news) return;
        json entry = countsJson(pass.counts);
        entry["pass"] = passes_;
        entry["alike"] = pass.clean;
        console.item(entry);
        if (pass.counts.all() > 0) {
            console.text("pass " + formatCount(passes_) + ": " + countsText(pass.counts) + ", in " +
                         formatSeconds(std::chrono::duration<double>(took).count()) + "\n");
        }
        if (pass.clean) console.text(alikeText());
    }

    std::string alikeText() const {
        const std::string refusals = run_.refusals() == 0
                                         ? std::string()
                                         : ", but for " + formatCount(run_.refusals()) + " that it refused";
        return sides_.to.address() + " has what " + sides_.from.address() + " has" + refusals +
               (flags_.once ? "\n" : "; following until Ctrl-C\n");
    }

    void tellEnd() {
        json document = countsJson(counts_);
        document["from"] = sides_.from.address();
        document["to"] = sides_.to.address();
        document["restored"] = restoredJson();
        document["passes"] = passes_;
        document["alike"] = alike_;
        document["refused"] = refused_;
        document["pending"] = pending();
        session_.console().document(document);
        const std::uint64_t waiting =
            document["pending"].is_null() ? 0 : document["pending"].get<std::uint64_t>();
        if (waiting > 0) {
            session_.console().text(formatCount(waiting, "shape", "shapes") + " there " +
                                    (waiting == 1 ? "is" : "are") + " still to be segmented\n");
        }
    }

    json restoredJson() const {
        if (!restored_) return nullptr;
        return {{"collections", restored_->collections}, {"shapes", restored_->shapes}};
    }

    /// Of the other server; null after Ctrl-C.
    json pending() const {
        if (session_.interrupted()) return nullptr;
        const auto stats = sides_.to.stats(context_);
        return stats ? json(stats->shapesPending) : json();
    }

    Session& session_;
    const CopyFlags& flags_;
    CopySides sides_;
    RunContext context_;
    CopyRun run_;
    std::optional<client::RestoreReport> restored_;
    CopyCounts counts_;
    std::uint64_t passes_ = 0;
    bool alike_ = false;  ///< when the last pass began
    bool away_ = false;   ///< a server does not answer
    json refused_ = json::array();
};

json differenceJson(const NamedDifference& one) {
    const auto state = [](const std::optional<client::Shape>& shape) {
        return shape ? json(client::stateName(shape->state)) : json();
    };
    return {{"collection", one.collection},
            {"key", one.pair.key()},
            {"difference", differenceName(differenceOf(one.pair))},
            {"from_state", state(one.pair.from)},
            {"to_state", state(one.pair.to)}};
}

json comparisonJson(const CopySides& sides, const CopyComparison& found) {
    json collections = json::array();
    for (const CollectionComparison& one : found.collections) {
        collections.push_back({{"collection", one.name},
                               {"from_shapes", one.from},
                               {"to_shapes", one.to},
                               {"different", one.different}});
    }
    json names = json::array();
    for (const CollectionStep& step : found.steps) names.push_back(stepText(step));
    json differences = json::array();
    for (const NamedDifference& one : found.differences) differences.push_back(differenceJson(one));
    return {{"from", sides.from.address()}, {"to", sides.to.address()},    {"equal", found.equal()},
            {"collections", collections},   {"collections_differ", names}, {"different", found.different},
            {"differences", differences}};
}

std::string differenceText(const NamedDifference& one) {
    const ShapeDifference difference = differenceOf(one.pair);
    std::string text =
        inLine(one.collection) + "/" + inLine(one.pair.key()) + ": " + differenceName(difference);
    if (difference == ShapeDifference::kState) {
        text += std::string(" ") + client::stateName(one.pair.from->state) + ", there " +
                client::stateName(one.pair.to->state);
    }
    return text + "\n";
}

std::string comparisonText(const CopySides& sides, const CopyComparison& found) {
    const auto right = Table::Align::kRight;
    Table table(
        {{"collection"}, {sides.from.address(), right}, {sides.to.address(), right}, {"different", right}});
    for (const CollectionComparison& one : found.collections) {
        table.add({one.name, formatCount(one.from), formatCount(one.to), formatCount(one.different)});
    }
    std::string text = table.render() + "\n";
    for (const CollectionStep& step : found.steps) text += inLine(stepText(step)) + "\n";
    for (const NamedDifference& one : found.differences) text += differenceText(one);
    if (found.different > found.differences.size()) {
        text += "and " + formatCount(found.different - found.differences.size()) + " more\n";
    }
    return text + (found.equal() ? "equal\n" : "not equal\n");
}

CommandResult runVerify(Session& session, const CopySides& sides) {
    RunContext context = session.context();
    context.progress = nullptr;  // progress counts shapes
    const auto found = compareServers(
        sides,
        [&](const std::string& what, std::uint64_t done, std::uint64_t total) {
            session.console().progress(what, done, total);
        },
        context);
    RETURN_IF_ERROR(found);
    session.console().document(comparisonJson(sides, *found));
    session.console().text(comparisonText(sides, *found));
    return found->equal() ? kOk : kSomeFailed;
}

/// A server is not copied to itself, under whatever name.
Result<void> requireTwo(const CopySides& sides, const RunContext& context) {
    const auto from = sides.from.serverInfo(context);
    RETURN_IF_ERROR(from);
    const auto to = sides.to.serverInfo(context);
    RETURN_IF_ERROR(to);
    if (sides.from.address() != sides.to.address() && from->started != to->started) return {};
    return fail(ErrorCode::kInvalidArgument,
                sides.from.address() + " and " + sides.to.address() + " are the same server: name two");
}

CommandResult runCopy(Session& session, const CopyFlags& flags) {
    const auto from = connectTo(session, flags.from);
    RETURN_IF_ERROR(from);
    const auto to = connectTo(session, flags.to);
    RETURN_IF_ERROR(to);
    RETURN_IF_ERROR(requireTwo({*from, *to}, session.context()));
    if (flags.verify) return runVerify(session, {*from, *to});
    // A full queue is waited for.
    const auto patient = connectTo(session, flags.to, Work::kHeavy);
    RETURN_IF_ERROR(patient);
    return Copying(session, flags, {*from, *patient})();
}

/// The options of one of the two servers, each in place of the one that every command has.
void addServerFlags(CLI::App& command, const std::string& side, const std::string& title,
                    ServerFlags& flags) {
    const auto add = [&](const std::string& name, std::string& value, const std::string& type) {
        command.add_option("--" + side + "-" + name, value, "In place of --" + name)
            ->type_name(type)
            ->group(title);
    };
    add("key-file", flags.keyFile, "FILE");
    command.add_flag("--" + side + "-tls", flags.tls.enabled, "As --tls, but of this server alone")
        ->group(title);
    add("tls-ca", flags.tls.caFile, "FILE");
    add("client-certificate", flags.tls.certificateFile, "FILE");
    add("client-key", flags.tls.keyFile, "FILE");
    add("server-name", flags.tls.serverName, "NAME");
}

}  // namespace

void addCopyCommand(CLI::App& admin, Session& session) {
    auto flags = std::make_shared<CopyFlags>();
    CLI::App* command = admin.add_subcommand(
        "copy",
        "Copy everything to another server while the first is in use: a backup and its restore, then what "
        "changes, until Ctrl-C");
    command->add_option("FROM", flags->from.address, "Server that has it: HOST:PORT")->required();
    command->add_option("TO", flags->to.address, "Server that gets it: HOST:PORT")->required();
    auto* force = command->add_flag("--force", flags->force, "Replace the shapes that TO has");
    auto* resume = command->add_flag("--continue", flags->resume,
                                     "Without a backup: copy what differs, delete what FROM does not have");
    auto* once = command->add_flag("--once", flags->once, "End as soon as TO has what FROM has");
    auto* jobs = command->add_option("--jobs", flags->jobs, "Shapes copied at the same time");
    jobs->check(CLI::Range(1, 64))->capture_default_str();
    resume->excludes(force);
    command
        ->add_flag(
            "--verify", flags->verify,
            "Copy nothing: compare points, metadata and state of every shape; exit code 1 if they differ")
        ->excludes(force)
        ->excludes(resume)
        ->excludes(once)
        ->excludes(jobs);
    addServerFlags(*command, "from", "Key and TLS of FROM", flags->from);
    addServerFlags(*command, "to", "Key and TLS of TO", flags->to);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runCopy(session, *flags); }; });
}

}  // namespace shapedb::cli
