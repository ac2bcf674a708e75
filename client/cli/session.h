// What every command gets: the options all commands share, the console, and how to be stopped.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "client/cli/console.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

struct GlobalOptions {
    bool json = false;
    std::string server;                    ///< HOST:PORT
    std::optional<double> timeoutSeconds;  ///< of the whole command when set
};

/// A finished command gives its exit code; an error that ends it is printed by the caller.
using CommandResult = Result<int>;

/// One run of the program.
class Session {
  public:
    /// Both must outlive the session; `cancel` is set by the signal handler.
    Session(Console& console, const std::atomic<bool>& cancel) : console_(console), cancel_(cancel) {}

    [[nodiscard]] Console& console() { return console_; }
    [[nodiscard]] const GlobalOptions& options() const { return options_; }
    [[nodiscard]] GlobalOptions& options() { return options_; }

    /// Cancelled by Ctrl-C, bounded by --timeout (counted from the first call), reporting to the
    /// progress bar with `what` in front of the stage.
    [[nodiscard]] RunContext context(const std::string& what = {});

    /// Set by the subcommand the user named; run after the whole command line was read.
    std::function<CommandResult()> action;

  private:
    Console& console_;
    const std::atomic<bool>& cancel_;
    GlobalOptions options_;
    std::optional<RunContext::Clock::time_point> deadline_;
};

/// Each adds its subcommands to `app`; both must live as long as the program.
void addSegmentCommand(CLI::App& app, Session& session);
void addSampleCommand(CLI::App& app, Session& session);
void addEvaluateCommand(CLI::App& app, Session& session);
void addAddCommand(CLI::App& app, Session& session);
void addQueryCommand(CLI::App& app, Session& session);
void addCompareCommand(CLI::App& app, Session& session);
void addShapeCommands(CLI::App& app, Session& session);
void addCollectionCommands(CLI::App& app, Session& session);
void addAdminCommands(CLI::App& app, Session& session);
void addHealthCommand(CLI::App& app, Session& session);

/// The whole program but for the signal handler: reads the command line, runs the command,
/// prints its result or error. Never throws.
[[nodiscard]] int run(int argc, const char* const* argv, Console& console, const std::atomic<bool>& cancel);

}  // namespace shapedb::cli
