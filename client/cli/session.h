// SPDX-License-Identifier: GPL-3.0-or-later
// What every command gets: the global options, the console and the means to stop it.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "client/api/client.h"
#include "client/cli/console.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

struct GlobalOptions {
    bool json = false;
    bool jsonLines = false;
    std::string server;   ///< HOST:PORT
    std::string keyFile;  ///< of the API key; this and the next ones override the environment
    client::TlsOptions tls;
    std::optional<double> timeoutSeconds;  ///< for the whole command
};

/// Session::leftBehind of commands that ask the server for one change.
constexpr const char* kPerhapsChanged = "the server may have completed it anyway";

/// The exit code of a finished command, or the error that ended it, which the caller prints.
using CommandResult = Result<int>;

/// One run of the program.
class Session {
  public:
    /// Both must outlive the session; `cancel` is set by the signal handler.
    Session(Console& console, const std::atomic<bool>& cancel) : console_(console), cancel_(cancel) {}

    [[nodiscard]] Console& console() { return console_; }
    [[nodiscard]] const GlobalOptions& options() const { return options_; }
    [[nodiscard]] GlobalOptions& options() { return options_; }

    /// Cancelled by Ctrl-C, limited by --timeout (from the first call on), and shown in the progress bar with
    /// `what` before the stage.
    [[nodiscard]] RunContext context(const std::string& what = {});

    /// What Ctrl-C leaves behind, as the end of "interrupted: "; commands that change something say so here.
    std::string leftBehind = "there is no result, and nothing was written";
    /// Whether Ctrl-C was pressed.
    [[nodiscard]] bool interrupted() const { return cancel_.load(std::memory_order_relaxed); }

    /// Set by the subcommand that was named; runs after the whole command line was read.
    std::function<CommandResult()> action;

  private:
    Console& console_;
    const std::atomic<bool>& cancel_;
    GlobalOptions options_;
    std::optional<RunContext::Clock::time_point> deadline_;
};

/// Each adds its subcommands to `app`; both arguments must outlive the parsing and the action.
void addSegmentCommand(CLI::App& app, Session& session);
void addSampleCommand(CLI::App& app, Session& session);
void addEvaluateCommand(CLI::App& app, Session& session);
void addAddCommand(CLI::App& app, Session& session);
void addQueryCommand(CLI::App& app, Session& session);
void addCompareCommand(CLI::App& app, Session& session);
void addAlignCommand(CLI::App& app, Session& session);
void addShapeCommands(CLI::App& app, Session& session);
void addChangeCommands(CLI::App& app, Session& session);
void addCollectionCommands(CLI::App& app, Session& session);
void addAdminCommands(CLI::App& app, Session& session);
void addHealthCommand(CLI::App& app, Session& session);
void addDuplicatesCommand(CLI::App& app, Session& session);
void addMatchCommand(CLI::App& app, Session& session);
void addReportCommand(CLI::App& app, Session& session);
/// help, completion and man: documents the other commands, which must have been added before.
void addHelpCommands(CLI::App& app, Session& session);
/// Below `shapedb admin`.
void addBackupCommands(CLI::App& admin, Session& session);
void addCopyCommand(CLI::App& admin, Session& session);
void addKeyCommands(CLI::App& admin, Session& session);

/// The whole program without its signal handler: reads the command line, runs the command, prints the result
/// or the error. Never throws. `build` is what `--version` adds in a line of its own.
[[nodiscard]] int run(int argc, const char* const* argv, Console& console, const std::atomic<bool>& cancel,
                      const std::string& build = {});

}  // namespace shapedb::cli
