// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb help|completion|man`: what is said of the commands, all made from their definitions.
#include <filesystem>
#include <fstream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/completion.h"
#include "client/cli/console.h"
#include "client/cli/session.h"
#include "client/cli/usage.h"
#include "common/nearest_name.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

namespace {

/// The command that words name: {"admin", "key"}. Errors: kInvalidArgument, saying what was probably meant.
Result<const CLI::App*> commandNamed(const CLI::App& app, const std::vector<std::string>& words) {
    const CLI::App* at = &app;
    for (const std::string& word : words) {
        const CLI::App* found = nullptr;
        std::vector<std::string> names;
        for (const CLI::App* sub : shownCommands(*at)) {
            names.push_back(sub->get_name());
            if (sub->get_name() == word) found = sub;
        }
        if (found == nullptr) {
            return fail(ErrorCode::kInvalidArgument, fullName(*at) + " has no command '" + word + "'" +
                                                         didYouMean(nearestName(word, names)));
        }
        at = found;
    }
    return at;
}

CommandResult runHelp(Session& session, const CLI::App& app, const std::vector<std::string>& words) {
    const auto command = commandNamed(app, words);
    RETURN_IF_ERROR(command);
    const std::string text =
        (*command)->get_formatter()->make_help(*command, fullName(**command), CLI::AppFormatMode::Normal);
    session.console().document({{"help", text}});
    session.console().text(text);
    return kOk;
}

CommandResult runCompletion(Session& session, const std::string& shell) {
    const auto script = completionScript(shell);
    session.console().document({{"shell", shell}, {"script", *script}});
    session.console().text(*script);
    return kOk;
}

Result<void> writePages(const CLI::App& command, const fs::path& folder, const std::string& version,
                        std::vector<std::string>& written) {
    const fs::path file = folder / (manualName(command) + ".1");
    std::ofstream stream(file, std::ios::binary);
    if (!(stream << manualPage(command, version) << std::flush)) {
        return fail(ErrorCode::kFileNotWritable, file.string() + ": cannot be written");
    }
    written.push_back(file.string());
    for (const CLI::App* sub : shownCommands(command)) {
        RETURN_IF_ERROR(writePages(*sub, folder, version, written));
    }
    return {};
}

struct ManualFlags {
    std::vector<std::string> words;
    std::string folder;
};

CommandResult runManual(Session& session, CLI::App& app, const ManualFlags& flags) {
    const std::string version = app.version();
    if (flags.folder.empty()) {
        const auto command = commandNamed(app, flags.words);
        RETURN_IF_ERROR(command);
        const std::string page = manualPage(**command, version);
        session.console().document({{"page", page}});
        session.console().text(page);
        return kOk;
    }
    if (!flags.words.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "--out writes the pages of all commands: leave out the name");
    }
    std::error_code error;
    fs::create_directories(flags.folder, error);
    if (error) return fail(ErrorCode::kFileNotWritable, flags.folder + ": " + error.message());
    std::vector<std::string> written;
    RETURN_IF_ERROR(writePages(app, flags.folder, version, written));
    session.console().document({{"pages", written}});
    session.console().text(std::to_string(written.size()) + " pages in " + flags.folder + "\n");
    return kOk;
}

}  // namespace

void addHelpCommands(CLI::App& app, Session& session) {
    auto words = std::make_shared<std::vector<std::string>>();
    CLI::App* help = app.add_subcommand("help", "Show what a command does and its flags");
    help->add_option("COMMAND", *words, "e.g. query, or admin key create");
    help->callback([&session, &app, words] {
        session.action = [&session, &app, words] { return runHelp(session, app, *words); };
    });

    auto shell = std::make_shared<std::string>();
    CLI::App* completion = app.add_subcommand(
        "completion",
        "Print what a shell loads to complete commands and flags: eval \"$(shapedb completion bash)\"");
    completion->add_option("SHELL", *shell, "bash, zsh or fish")
        ->required()
        ->check(CLI::IsMember({"bash", "zsh", "fish"}));
    completion->callback(
        [&session, shell] { session.action = [&session, shell] { return runCompletion(session, *shell); }; });

    auto manual = std::make_shared<ManualFlags>();
    CLI::App* man =
        app.add_subcommand("man", "Print the manual page of a command, or write all: man -l <(shapedb man)");
    man->add_option("COMMAND", manual->words, "e.g. query, or admin key create; none: shapedb itself");
    man->add_option("-o,--out", manual->folder, "Write the pages of all commands into this folder")
        ->type_name("DIR");
    man->callback([&session, &app, manual] {
        session.action = [&session, &app, manual] { return runManual(session, app, *manual); };
    });
}

}  // namespace shapedb::cli
