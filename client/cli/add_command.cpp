// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb add`: stores files and folders of scans in a collection.
#include <algorithm>
#include <atomic>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/api/packing.h"
#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/failures.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "client/cli/upload.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

/// With more files than this only the totals are printed.
constexpr std::size_t kListedFiles = 30;

/// What all uploads of a command have in common.
struct Terms {
    client::Metadata metadata;
    double factor = 1.0;  ///< to the unit of the collection
    /// What the collection has under the keys of the files.
    std::map<std::string, client::Shape> stored;
};

/// One run of the command.
struct Run {
    Session& session;
    const client::Client& client;
    const AddFlags& flags;
    Terms terms;
    std::vector<Upload> uploads;
    std::optional<Error> stop;  ///< why it ended before all was done

    [[nodiscard]] RunContext context() const {
        RunContext context = session.context();
        context.progress = nullptr;  // progress counts files
        return context;
    }
};

json uploadJson(const Upload& upload) {
    if (upload.failure) {
        return {{"file", upload.path}, {"key", upload.key}, {"error", toJson(*upload.failure)}};
    }
    json entry = toJson(upload.reply->shape);
    entry["file"] = upload.path;
    entry["outcome"] = client::outcomeName(upload.reply->outcome);
    return entry;
}

/// The shape that is there already, if nothing need be sent: what an interrupted run has sent is not sent
/// again.
const client::Shape* alreadyStored(const Run& run, const client::AddRequest& request,
                                   const client::PackedPoints& packed) {
    const auto found = run.terms.stored.find(request.shape.key);
    if (found == run.terms.stored.end()) return nullptr;
    const client::Shape& shape = found->second;
    const bool safe =
        request.mode == client::AddMode::kSamePoints || request.mode == client::AddMode::kUpsert;
    const bool same = shape.sha256 == packed.sha256 && shape.origin == packed.origin &&
                      (!request.metadata || *request.metadata == shape.metadata);
    // One that failed is tried again.
    return safe && same && shape.state != client::ShapeState::kFailed ? &shape : nullptr;
}

/// --update-only without --replace: the version with which the request finds the shape, or not the same one.
/// Errors: kNotFound, those of Client::getShapes.
Result<std::int64_t> versionToUpdate(const Run& run, const std::string& key, const RunContext& context) {
    const auto known = run.terms.stored.find(key);
    if (known != run.terms.stored.end()) return known->second.version;
    const auto found = run.client.getShapes(run.flags.collection, {key}, context);
    RETURN_IF_ERROR(found);
    if (!found->shapes.empty()) return found->shapes.front().version;
    return fail(ErrorCode::kNotFound,
                "no shape has the key '" + key + "': without --update-only it is added");
}

void send(const Run& run, PointCloud points, Upload& upload, const RunContext& context) {
    if (run.terms.factor != 1.0) scaleBy(run.terms.factor, points);
    client::AddRequest request = requestFor(run.flags, run.terms.metadata, upload);
    if (run.flags.updateOnly && !run.flags.replace) {
        const auto version = versionToUpdate(run, upload.key, context);
        if (!version) {
            upload.failure = version.error();
            return;
        }
        request.expectedVersion = *version;
    }
    if (run.terms.stored.count(upload.key) > 0) {
        const auto packed = client::packPoints(points);
        const client::Shape* stored = packed ? alreadyStored(run, request, *packed) : nullptr;
        if (stored != nullptr) {
            upload.reply = client::AddReply{client::AddOutcome::kUnchanged, *stored};
            return;
        }
    }
    auto reply = run.client.addShape(request, points, context);
    if (!reply) {
        upload.failure = reply.error();
        if (reply.error().code == ErrorCode::kAlreadyExists && !run.flags.insertOnly) {
            upload.failure->message += ": --replace replaces them, --key gives this scan another key";
        }
    } else {
        upload.reply = std::move(*reply);
    }
}

/// Reads a file once and sends it: the whole scan, or with --each each of its objects, with keys KEY/1,
/// KEY/2, ... if there are several. Returns what was sent, or not.
std::vector<Upload> uploadFile(const Run& run, const Upload& file, const RunContext& context) {
    const AddFlags& flags = run.flags;
    std::vector<Upload> uploads{file};
    auto scan = loadScan(file.path, flags.scan, fileSeed(flags.scan.seed, file.name), context, flags.each);
    if (!scan) {
        uploads.front().failure = scan.error();
        return uploads;
    }
    for (const std::string& list : scan->ignored) {
        run.session.console().note(file.path + ": passed over: " + list);
    }
    const std::size_t objects = flags.each ? scan->scene->objects.size() : 0;
    if (objects == 0) {
        send(run, std::move(scan->points), uploads.front(), context);
        return uploads;
    }
    uploads.assign(objects, file);
    for (std::size_t i = 0; i < objects; ++i) {
        if (objects > 1) uploads[i].key += "/" + std::to_string(i + 1);
        if (i > 0 && uploads[i - 1].failure && endsTheCommand(*uploads[i - 1].failure)) {
            uploads[i].failure = uploads[i - 1].failure;
            continue;
        }
        send(run, pointsOfObject(scan->points, *scan->scene, i), uploads[i], context);
    }
    return uploads;
}

/// What the collection has under the keys of the files; objects of --each have keys of their own.
Result<void> lookUp(Run& run, const std::vector<Upload>& files) {
    constexpr std::size_t kKeysPerRequest = 1000;  // the server's limit
    const RunContext context = run.context();
    for (std::size_t at = 0; at < files.size() && !run.flags.each; at += kKeysPerRequest) {
        std::vector<std::string> keys;
        for (std::size_t i = at; i < std::min(files.size(), at + kKeysPerRequest); ++i) {
            keys.push_back(files[i].key);
        }
        auto found = run.client.getShapes(run.flags.collection, keys, context);
        // A wrong key is reported with its file.
        if (!found && found.error().code == ErrorCode::kInvalidArgument) continue;
        RETURN_IF_ERROR(found);
        for (client::Shape& shape : found->shapes) {
            std::string key = shape.key;
            run.terms.stored.emplace(std::move(key), std::move(shape));
        }
        run.session.console().progress("look up", std::min(files.size(), at + kKeysPerRequest), files.size());
    }
    return {};
}

/// `jobs` threads take one file after the other until all are done or the others would fail too. The uploads
/// are in the order of the files.
void uploadAll(Run& run, const std::vector<Upload>& files) {
    const RunContext context = run.context();
    std::vector<std::vector<Upload>> uploadsOf(files.size());
    std::atomic<std::size_t> next{0};
    std::atomic<std::size_t> done{0};
    std::mutex mutex;  // guards run.stop and items
    const auto finish = [&](std::vector<Upload>& uploads) {
        const std::lock_guard<std::mutex> lock(mutex);
        for (Upload& upload : uploads) {
            if (upload.failure && endsTheCommand(*upload.failure)) {
                if (!run.stop) run.stop = upload.failure;
                // Interrupted, not failed.
                if (upload.failure->code == ErrorCode::kCancelled) upload.failure.reset();
            }
            const bool known = upload.failure || (upload.reply && !run.flags.wait);
            if (known) run.session.console().item(uploadJson(upload));
        }
    };
    const auto work = [&] {
        for (std::size_t i = next++; i < files.size(); i = next++) {
            {
                const std::lock_guard<std::mutex> lock(mutex);
                if (run.stop) {
                    uploadsOf[i] = {files[i]};
                    continue;
                }
            }
            uploadsOf[i] = uploadFile(run, files[i], context);
            finish(uploadsOf[i]);
            run.session.console().progress("upload", ++done, files.size());
        }
    };
    std::vector<std::thread> workers;
    const std::size_t count = std::min<std::size_t>(std::max(1u, run.flags.jobs), files.size());
    for (std::size_t i = 1; i < count; ++i) workers.emplace_back(work);
    work();
    for (std::thread& worker : workers) worker.join();
    for (std::vector<Upload>& some : uploadsOf)
        std::move(some.begin(), some.end(), std::back_inserter(run.uploads));
}

/// The change of the upload says nothing of the signature: takes the one that does.
void learnChange(const Run& run, client::Shape& shape, const RunContext& context) {
    if (shape.change == 0) return;
    const auto now = run.client.getShape({run.flags.collection, shape.key}, context);
    if (now) shape.change = now->change;
}

/// Follows the shapes one after the other; the server segments all of them meanwhile.
void waitForAll(Run& run) {
    const RunContext context = run.context();
    std::size_t done = 0;
    for (Upload& upload : run.uploads) {
        run.session.console().progress("segment", done++, run.uploads.size());
        if (!upload.reply) continue;
        client::Shape& shape = upload.reply->shape;
        if (shape.state == client::ShapeState::kPending && !run.stop) {
            const auto last = run.client.watchIngest({run.flags.collection, upload.key}, {}, context);
            if (!last && endsTheCommand(last.error())) {
                run.stop = last.error();
            } else if (!last) {
                upload.failure = last.error();
            } else {
                shape.state = last->state;
                shape.failure = last->failure;
                shape.quality = last->quality;
                learnChange(run, shape, context);
            }
        }
        if (shape.failure) upload.failure = shape.failure;
        run.session.console().item(uploadJson(upload));
    }
}

json uploadsJson(const Run& run) {
    json added = json::array();
    json failed = json::array();
    json notSent = json::array();
    std::map<std::string, std::size_t> outcomes;
    for (const Upload& upload : run.uploads) {
        if (upload.failure) {
            failed.push_back(uploadJson(upload));
        } else if (upload.reply) {
            ++outcomes[client::outcomeName(upload.reply->outcome)];
            added.push_back(uploadJson(upload));
        } else {
            notSent.push_back(upload.path);
        }
    }
    json document = {{"added", added}, {"failed", failed}, {"outcomes", outcomes}, {"not_sent", notSent}};
    if (run.stop) document["ended_by"] = toJson(*run.stop);
    return document;
}

std::string uploadsText(const std::vector<Upload>& uploads) {
    std::map<std::string, std::size_t> outcomes;
    std::size_t stored = 0;
    std::size_t doubtful = 0;
    Table table({{"key"},
                 {"label"},
                 {"points", Table::Align::kRight},
                 {"outcome"},
                 {"state"},
                 {"quality", Table::Align::kRight}});
    for (const Upload& upload : uploads) {
        if (!upload.reply) continue;
        const client::Shape& shape = upload.reply->shape;
        ++outcomes[client::outcomeName(upload.reply->outcome)];
        ++stored;
        table.add({shape.key, labelOf(shape), formatCount(shape.pointCount),
                   client::outcomeName(upload.reply->outcome), client::stateName(shape.state),
                   shape.quality ? formatFixed(*shape.quality, 2) : std::string()});
        if (shape.quality && *shape.quality < kQualityWorthWarning) ++doubtful;
    }
    std::string text = stored > 0 && stored <= kListedFiles ? table.render() + "\n" : std::string();
    text += formatCount(stored, "scan", "scans") + " stored";
    const char* separator = ": ";
    for (const auto& [outcome, count] : outcomes) {
        text += separator + formatCount(count) + " " + outcome;
        separator = ", ";
    }
    if (doubtful > 0) {
        text += "; in " + formatCount(doubtful, "scan", "scans") +
                " the interior is a guess (quality below " + formatNumber(kQualityWorthWarning) + ")";
    }
    return text + "\n";
}

/// Reports what an interrupted command has not done.
void tellStop(const Run& run) {
    std::size_t notSent = 0;
    std::size_t pending = 0;
    for (const Upload& upload : run.uploads) {
        if (!upload.reply && !upload.failure) ++notSent;
        if (upload.reply && upload.reply->shape.state == client::ShapeState::kPending) ++pending;
    }
    std::string text = run.stop->code == ErrorCode::kCancelled ? "interrupted" : run.stop->message;
    if (notSent > 0) {
        text += ": " + formatCount(notSent) + " of " + formatCount(run.uploads.size(), "scan", "scans") +
                " not sent; the same command continues";
    } else if (run.flags.wait && pending > 0) {
        text += ": all scans are stored, " + formatCount(pending) +
                " of them not seen to be segmented yet; the server goes on, and the same command waits again";
    }
    run.session.console().note(text);
}

/// Prints each failure; returns the exit code of the command.
int reportFailures(const Run& run) {
    Failures failures;
    for (const Upload& upload : run.uploads) {
        if (upload.failure) failures.add(scanName(upload.path), *upload.failure);
    }
    failures.tell(run.session.console(), run.uploads.size(), "file", "files");
    if (!run.stop) return failures.exitCode(run.uploads.size());
    // One file that failed has said why.
    if (run.uploads.size() > 1 || failures.empty()) tellStop(run);
    return exitCodeOf(run.stop->code);
}

CommandResult runAdd(Session& session, const AddFlags& flags) {
    const auto metadata = parseMetadata(flags.metadata, "--meta");
    RETURN_IF_ERROR(metadata);
    const auto files = listUploads(flags);
    RETURN_IF_ERROR(files);
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    // Checked first, so that a wrong collection is reported once and not for every file.
    RETURN_IF_ERROR(client->getCollection(flags.collection, session.context()));
    const auto factor = factorToCollection(*client, flags.collection, flags.unit, session.context());
    RETURN_IF_ERROR(factor);
    Run run{session, *client, flags, {*metadata, *factor, {}}, {}, std::nullopt};
    RETURN_IF_ERROR(lookUp(run, *files));
    uploadAll(run, *files);
    if (flags.wait) waitForAll(run);
    if (!session.console().lines()) session.console().document(uploadsJson(run));
    session.console().text(uploadsText(run.uploads));
    return reportFailures(run);
}

}  // namespace

void addAddCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<AddFlags>();
    CLI::App* command = app.add_subcommand("add", "Store scans: files, or folders searched to any depth");
    command->add_option("PATH", flags->paths, "Scan files or folders, or - for standard input")->required();
    addCollectionOption(*command, flags->collection);
    command
        ->add_option("--key", flags->key,
                     "Key, if there is only one scan [path below the current folder, without ending]")
        ->check(notEmpty());
    command->add_flag("--keep-ending", flags->keepEnding,
                      "Keys keep the endings of the files, as for box.stl beside box.obj");
    command->add_option("--base", flags->base, "Keys are paths below this folder instead of the current one")
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
    command->add_flag("--label-from-folder", flags->labelFromFolder,
                      "Set the metadata 'label' to the name of the file's folder");
    command->add_option("--meta", flags->metadata, "Metadata of all scans; may be repeated")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    auto* insertOnly = command->add_flag("--insert-only", flags->insertOnly, "Fail if the key is taken");
    command->add_flag("--update-only", flags->updateOnly, "Fail if no shape has the key")
        ->excludes(insertOnly);
    command->add_flag("--replace", flags->replace, "Replace the stored points of a key if they differ")
        ->excludes(insertOnly);
    command->add_flag("--wait", flags->wait, "Wait until all scans are segmented, not only stored");
    command
        ->add_option("--jobs", flags->jobs,
                     "Files sent at the same time; with 1 their ids follow the order of the files")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    auto* each = command->add_flag("--each", flags->each,
                                   "Store each of several separate objects of a scan, without the plane that "
                                   "they stand on, as KEY/1, KEY/2, ...");
    addScanFlags(*command, flags->scan);
    addFormatFlag(*command, flags->scan);
    addUnitFlag(*command, flags->unit);
    for (const char* other : {"--drop-plane", "--largest", "--points"}) {
        each->excludes(command->get_option(other));
    }
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runAdd(session, *flags); }; });
}

}  // namespace shapedb::cli
