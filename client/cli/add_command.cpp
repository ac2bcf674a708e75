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

#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

/// With more files than this only the totals are printed.
constexpr std::size_t kListedFiles = 30;

struct AddFlags {
    std::vector<std::string> paths;
    std::string collection;
    std::string key;
    std::string base;
    std::vector<std::string> metadata;
    bool labelFromFolder = false;
    bool insertOnly = false;
    bool updateOnly = false;
    bool replace = false;
    bool wait = false;
    bool each = false;
    unsigned jobs = 1;
    ScanFlags scan;
    std::optional<LengthUnit> unit;
};

struct Upload {
    std::string path;
    std::string name;  ///< relative to the given path; decides the seed
    std::string key;
    std::string label;
    std::optional<client::AddReply> reply;
    std::optional<Error> failure;
};

/// Standard input has no name that a key could come from.
Result<Upload> uploadOfStandardInput(const AddFlags& flags) {
    if (flags.key.empty()) return fail(ErrorCode::kInvalidArgument, "standard input needs --key");
    if (flags.each) {
        return fail(ErrorCode::kInvalidArgument,
                    "--each reads a scan twice, which standard input cannot be: give a file");
    }
    Upload upload;
    upload.path = upload.name = "-";
    return upload;
}

Result<std::vector<Upload>> listUploads(const AddFlags& flags) {
    std::vector<Upload> uploads;
    for (const std::string& path : flags.paths) {
        if (path == "-") {
            auto upload = uploadOfStandardInput(flags);
            RETURN_IF_ERROR(upload);
            uploads.push_back(std::move(*upload));
            continue;
        }
        const auto files = listScanFiles({path}, !flags.scan.format.empty());
        RETURN_IF_ERROR(files);
        for (const ScanFile& file : *files) {
            Upload upload;
            upload.path = file.path;
            upload.name = relativeName(file.path, path);
            auto key = keyOfFile(file.path, flags.base);
            RETURN_IF_ERROR(key);
            upload.key = std::move(*key);
            upload.label = file.label;
            uploads.push_back(std::move(upload));
        }
    }
    if (!flags.key.empty()) {
        if (uploads.size() != 1) {
            return fail(ErrorCode::kInvalidArgument,
                        "--key is for one scan, but there are " + std::to_string(uploads.size()) + " files");
        }
        uploads.front().key = flags.key;
    }
    return uploads;
}

/// Errors: kInvalidArgument naming two files with one key.
Result<void> checkKeys(const std::vector<Upload>& uploads) {
    std::map<std::string, std::string> taken;
    for (const Upload& upload : uploads) {
        const auto [other, isNew] = taken.emplace(upload.key, upload.path);
        if (!isNew) {
            return fail(ErrorCode::kInvalidArgument, other->second == upload.path
                                                         ? upload.path + " is given twice"
                                                         : other->second + " and " + upload.path +
                                                               " would both get the key '" + upload.key +
                                                               "'; add them one by one with --key");
        }
    }
    return {};
}

/// Whether `key` is one that --each may give an object of the scan with the key `of`: of/1, of/2, ...
bool mayBeObjectOf(const std::string& key, const std::string& of) {
    const std::size_t slash = key.rfind('/');
    return slash == of.size() && key.compare(0, slash, of) == 0 && slash + 1 < key.size() &&
           key.find_first_not_of("0123456789", slash + 1) == std::string::npos;
}

/// How many objects a scan has is known once it is read. Errors: kInvalidArgument naming two files of which
/// an object of one may get the key of the other.
Result<void> checkKeysOfObjects(const std::vector<Upload>& uploads) {
    std::map<std::string, std::string> taken;
    for (const Upload& upload : uploads) taken.emplace(upload.key, upload.path);
    for (const Upload& upload : uploads) {
        const auto parent = taken.find(upload.key.substr(0, upload.key.rfind('/')));
        if (parent == taken.end() || !mayBeObjectOf(upload.key, parent->first)) continue;
        return fail(ErrorCode::kInvalidArgument, "an object of " + parent->second + " and " + upload.path +
                                                     " might both get the key '" + upload.key +
                                                     "'; add them one by one with --key");
    }
    return {};
}

client::AddRequest requestFor(const AddFlags& flags, const client::Metadata& metadata, const Upload& upload) {
    client::AddRequest request;
    request.shape = {flags.collection, upload.key};
    // Without any a shape that has the key keeps what it has.
    if (!metadata.empty() || flags.labelFromFolder) request.metadata = metadata;
    if (flags.labelFromFolder) request.metadata->emplace("label", upload.label);
    // Two files may come to the same key, at different times or from different people.
    if (!flags.replace) request.mode = client::AddMode::kSamePoints;
    if (flags.insertOnly) request.mode = client::AddMode::kInsertOnly;
    if (flags.updateOnly) request.mode = client::AddMode::kUpdateOnly;
    return request;
}

/// What all uploads of a command have in common.
struct Terms {
    client::Metadata metadata;
    double factor = 1.0;  ///< to the unit of the collection
};

void send(const client::Client& client, const AddFlags& flags, const Terms& terms, PointCloud points,
          Upload& upload, const RunContext& context) {
    if (terms.factor != 1.0) scaleBy(terms.factor, points);
    auto reply = client.addShape(requestFor(flags, terms.metadata, upload), points, context);
    if (!reply) {
        upload.failure = reply.error();
        if (reply.error().code == ErrorCode::kAlreadyExists && !flags.insertOnly) {
            upload.failure->message += ": --replace replaces them, --key gives this scan another key";
        }
    } else {
        upload.reply = std::move(*reply);
    }
}

/// After such an error the other files would fail too.
bool endsTheRun(const Error& error) {
    return error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kCancelled ||
           error.code == ErrorCode::kDeadlineExceeded;
}

/// Reads a file once and sends it: the whole scan, or with --each each of its objects, with keys KEY/1,
/// KEY/2, ... if there are several. Returns what was sent, or not.
std::vector<Upload> uploadFile(const client::Client& client, const AddFlags& flags, const Terms& terms,
                               const Upload& file, const RunContext& context) {
    std::vector<Upload> uploads{file};
    auto scan = loadScan(file.path, flags.scan, fileSeed(flags.scan.seed, file.name), context, flags.each);
    if (!scan) {
        uploads.front().failure = scan.error();
        return uploads;
    }
    const std::size_t objects = flags.each ? scan->scene->objects.size() : 0;
    if (objects == 0) {
        send(client, flags, terms, std::move(scan->points), uploads.front(), context);
        return uploads;
    }
    uploads.assign(objects, file);
    for (std::size_t i = 0; i < objects; ++i) {
        if (objects > 1) uploads[i].key += "/" + std::to_string(i + 1);
        if (i > 0 && uploads[i - 1].failure && endsTheRun(*uploads[i - 1].failure)) {
            uploads[i].failure = uploads[i - 1].failure;
            continue;
        }
        send(client, flags, terms, pointsOfObject(scan->points, *scan->scene, i), uploads[i], context);
    }
    return uploads;
}

/// `jobs` threads take one file after the other until all are done or the server is gone. Returns the uploads
/// in the order of the files.
std::vector<Upload> uploadAll(Session& session, const client::Client& client, const AddFlags& flags,
                              const Terms& terms, const std::vector<Upload>& files) {
    RunContext context = session.context();
    context.progress = nullptr;  // progress counts files
    std::vector<std::vector<Upload>> uploadsOf(files.size());
    std::atomic<std::size_t> next{0};
    std::atomic<std::size_t> done{0};
    std::mutex mutex;
    std::optional<Error> stop;  // guarded by mutex
    const auto work = [&] {
        for (std::size_t i = next++; i < files.size(); i = next++) {
            {
                const std::lock_guard<std::mutex> lock(mutex);
                if (stop) {
                    uploadsOf[i] = {files[i]};
                    uploadsOf[i].front().failure = Error{stop->code, "not sent: " + stop->message};
                    continue;
                }
            }
            uploadsOf[i] = uploadFile(client, flags, terms, files[i], context);
            const std::optional<Error>& failure = uploadsOf[i].back().failure;
            if (failure && endsTheRun(*failure)) {
                const std::lock_guard<std::mutex> lock(mutex);
                if (!stop) stop = failure;
            }
            session.console().progress("upload", ++done, files.size());
        }
    };
    std::vector<std::thread> workers;
    const std::size_t count = std::min<std::size_t>(std::max(1u, flags.jobs), files.size());
    for (std::size_t i = 1; i < count; ++i) workers.emplace_back(work);
    work();
    for (std::thread& worker : workers) worker.join();
    std::vector<Upload> uploads;
    for (std::vector<Upload>& some : uploadsOf)
        std::move(some.begin(), some.end(), std::back_inserter(uploads));
    return uploads;
}

/// Follows the shapes one after the other; the server segments all of them meanwhile.
void waitForAll(Session& session, const client::Client& client, const AddFlags& flags,
                std::vector<Upload>& uploads) {
    RunContext context = session.context();
    context.progress = nullptr;
    std::size_t done = 0;
    for (Upload& upload : uploads) {
        session.console().progress("segment", done++, uploads.size());
        if (!upload.reply) continue;
        client::Shape& shape = upload.reply->shape;
        if (shape.state == client::ShapeState::kPending) {
            const auto last = client.watchIngest({flags.collection, upload.key}, {}, context);
            if (!last) {
                upload.failure = last.error();
                continue;
            }
            shape.state = last->state;
            shape.failure = last->failure;
            shape.quality = last->quality;
        }
        if (shape.failure) upload.failure = shape.failure;
    }
}

json uploadsJson(const std::vector<Upload>& uploads) {
    json added = json::array();
    json failed = json::array();
    std::map<std::string, std::size_t> outcomes;
    for (const Upload& upload : uploads) {
        if (upload.failure) {
            failed.push_back(
                {{"file", upload.path}, {"key", upload.key}, {"error", toJson(*upload.failure)}});
        } else if (upload.reply) {
            const char* outcome = client::outcomeName(upload.reply->outcome);
            ++outcomes[outcome];
            json entry = toJson(upload.reply->shape);
            entry["file"] = upload.path;
            entry["outcome"] = outcome;
            added.push_back(std::move(entry));
        }
    }
    return {{"added", added}, {"failed", failed}, {"outcomes", outcomes}};
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

/// Prints each failure; returns the exit code of the command.
int reportFailures(Session& session, const std::vector<Upload>& uploads) {
    std::size_t failed = 0;
    int last = kOk;
    for (const Upload& upload : uploads) {
        if (!upload.failure) continue;
        ++failed;
        last = exitCodeOf(upload.failure->code);
        const std::string& message = upload.failure->message;
        const bool named = message.find(scanName(upload.path)) != std::string::npos;
        session.console().note(named ? message : scanName(upload.path) + ": " + message);
    }
    if (failed == 0) return kOk;
    if (uploads.size() > 1) {
        session.console().note(formatCount(failed) + " of " + formatCount(uploads.size(), "file", "files") +
                               " failed");
    }
    // If everything failed for one reason, that reason's code; otherwise "some failed".
    const bool interrupted = last == kInterrupted;
    return failed == uploads.size() && (uploads.size() == 1 || last == kUnavailable) ? last
           : interrupted                                                             ? kInterrupted
                                                                                     : kSomeFailed;
}

CommandResult runAdd(Session& session, const AddFlags& flags) {
    const auto metadata = parseMetadata(flags.metadata, "--meta");
    RETURN_IF_ERROR(metadata);
    const auto files = listUploads(flags);
    RETURN_IF_ERROR(files);
    RETURN_IF_ERROR(checkKeys(*files));
    if (flags.each) RETURN_IF_ERROR(checkKeysOfObjects(*files));
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor = factorToCollection(*client, flags.collection, flags.unit, session.context());
    RETURN_IF_ERROR(factor);
    auto uploads = uploadAll(session, *client, flags, {*metadata, *factor}, *files);
    if (flags.wait) waitForAll(session, *client, flags, uploads);
    session.console().document(uploadsJson(uploads));
    session.console().text(uploadsText(uploads));
    return reportFailures(session, uploads);
}

}  // namespace

void addAddCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<AddFlags>();
    CLI::App* command = app.add_subcommand("add", "Store scans: files, or folders searched to any depth");
    command->add_option("PATH", flags->paths, "Scan files or folders, or - for standard input")->required();
    addCollectionOption(*command, flags->collection);
    command->add_option("--key", flags->key,
                        "Key, if there is only one scan [path below the current folder, without ending]");
    command->add_option("--base", flags->base, "Keys are paths below this folder instead of the current one")
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
    command->add_flag("--label-from-folder", flags->labelFromFolder,
                      "Set the metadata 'label' to the name of the file's folder");
    command->add_option("--meta", flags->metadata, "Metadata of all scans; may be repeated")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    auto* insertOnly = command->add_flag("--insert-only", flags->insertOnly, "Fail if the key is taken");
    command->add_flag("--update-only", flags->updateOnly, "Replace what has the key; fail if it is free")
        ->excludes(insertOnly);
    command->add_flag("--replace", flags->replace, "Replace other points that have the key")
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
