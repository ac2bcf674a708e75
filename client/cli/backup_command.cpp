// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin backup|restore|merge-backups`.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct BackupFlags {
    std::string file;
    std::optional<std::string> since;     ///< the file of an earlier backup or increment
    std::vector<std::string> increments;  ///< in the order they were made
    std::string out;

    /// The full backup and its increments.
    [[nodiscard]] std::vector<std::string> chain() const {
        std::vector<std::string> files{file};
        files.insert(files.end(), increments.begin(), increments.end());
        return files;
    }
};

std::string hexOf(const std::string& digest) { return toHex(digest.data(), digest.size()); }

/// "full.db", "full.db and 2 increments".
std::string chainText(const BackupFlags& flags) {
    if (flags.increments.empty()) return flags.file;
    return inLine(flags.file) + " and " + formatCount(flags.increments.size(), "increment", "increments");
}

CommandResult runIncrement(Session& session, const client::Client& client, const BackupFlags& flags) {
    const std::string& since = *flags.since;
    // A script that found no earlier backup must not get a full one in its place.
    if (since.empty()) return fail(ErrorCode::kInvalidArgument, "--since: the name of a file is missing");
    const auto report = client.incrementToFile(flags.file, since, session.context());
    RETURN_IF_ERROR(report);
    session.console().document({{"file", flags.file},
                                {"since", since},
                                {"bytes", report->bytes},
                                {"changed_bytes", report->changedBytes},
                                {"backup_bytes", report->backup.bytes},
                                {"backup_sha256", hexOf(report->backup.sha256)}});
    session.console().text(formatBytes(report->bytes) + " written to " + inLine(flags.file) + ": " +
                           formatBytes(report->changedBytes) + " of " + formatBytes(report->backup.bytes) +
                           " changed since " + since + "\n");
    return kOk;
}

CommandResult runBackup(Session& session, const BackupFlags& flags) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    if (flags.since) return runIncrement(session, *client, flags);
    const auto report = client->backupToFile(flags.file, session.context());
    RETURN_IF_ERROR(report);
    session.console().document(
        {{"file", flags.file}, {"bytes", report->bytes}, {"sha256", hexOf(report->sha256)}});
    session.console().text(formatBytes(report->bytes) + " written to " + inLine(flags.file) + "\n");
    return kOk;
}

CommandResult runRestore(Session& session, const BackupFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto report = client->restoreFromFiles(flags.chain(), session.context());
    RETURN_IF_ERROR(report);
    session.console().document({{"file", flags.file},
                                {"increments", flags.increments},
                                {"collections", report->collections},
                                {"shapes", report->shapes}});
    session.console().text(formatCount(report->shapes, "shape", "shapes") + " in " +
                           formatCount(report->collections, "collection", "collections") + " restored from " +
                           chainText(flags) + "\n");
    return kOk;
}

CommandResult runMerge(Session& session, const BackupFlags& flags) {
    const auto report = client::mergeBackups(flags.chain(), flags.out, session.context());
    RETURN_IF_ERROR(report);
    session.console().document({{"file", flags.out},
                                {"merged", flags.chain()},
                                {"bytes", report->bytes},
                                {"sha256", hexOf(report->sha256)}});
    session.console().text(formatBytes(report->bytes) + " written to " + inLine(flags.out) +
                           ", merged from " + chainText(flags) + "\n");
    return kOk;
}

/// With a FILE; the caller adds the rest to the flags.
CLI::App* addFileCommand(CLI::App& group, Session& session, const char* name, const char* help,
                         const std::shared_ptr<BackupFlags>& flags,
                         CommandResult (*runner)(Session&, const BackupFlags&)) {
    CLI::App* command = group.add_subcommand(name, help);
    command->add_option("FILE", flags->file, "Backup file")->required();
    command->callback([&session, flags, runner] {
        session.action = [&session, flags, runner] { return runner(session, *flags); };
    });
    return command;
}

CLI::Option* addIncrements(CLI::App& command, const std::shared_ptr<BackupFlags>& flags) {
    return command.add_option("INCREMENT", flags->increments,
                              "Increments made after it, in the order they were made");
}

}  // namespace

void addBackupCommands(CLI::App& admin, Session& session) {
    auto backup = std::make_shared<BackupFlags>();
    addFileCommand(admin, session, "backup", "Copy the whole database to a file while the server runs",
                   backup, &runBackup)
        ->add_option("--since", backup->since,
                     "Only what has changed since this backup, or since this increment of one")
        ->type_name("FILE");

    auto restore = std::make_shared<BackupFlags>();
    CLI::App* command = addFileCommand(admin, session, "restore", "Replace the whole database with a backup",
                                       restore, &runRestore);
    addIncrements(*command, restore);

    auto merge = std::make_shared<BackupFlags>();
    command =
        addFileCommand(admin, session, "merge-backups",
                       "Make one full backup of one and its increments; needs no server", merge, &runMerge);
    addIncrements(*command, merge)->required();
    command->add_option("-o,--out", merge->out, "The new full backup")->type_name("FILE")->required();
}

}  // namespace shapedb::cli
