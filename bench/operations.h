// SPDX-License-Identifier: GPL-3.0-or-later
// The operations of shapedb-bench. To add one, write a source file, declare its function here and call it in
// operations.cpp.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "client/cli/console.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace CLI {
class App;
}

namespace shapedb::bench {

/// What an operation is given: the console and how it is cancelled.
struct Bench {
    cli::Console& console;
    const std::atomic<bool>& cancel;  ///< set by Ctrl-C
    std::string command;              ///< as the user wrote it, program first

    /// Set by the subcommand the user chose; run once the whole command line is read. Returns the exit
    /// code.
    std::function<Result<int>()> action;

    [[nodiscard]] RunContext context() const {
        RunContext context;
        context.cancel = &cancel;
        return context;
    }
};

/// Each adds its subcommand to `app`; both must live as long as the program.
void addAlignOperation(CLI::App& app, Bench& bench);
void addViewsOperation(CLI::App& app, Bench& bench);
void addRetrievalOperation(CLI::App& app, Bench& bench);
void addInteriorOperation(CLI::App& app, Bench& bench);
void addTopKOperation(CLI::App& app, Bench& bench);
void addLoadOperation(CLI::App& app, Bench& bench);
void addBatchClientsOperation(CLI::App& app, Bench& bench);
void addInstructionsOperation(CLI::App& app, Bench& bench);
void addJobOperation(CLI::App& app, Bench& bench);
void addSegmentOperation(CLI::App& app, Bench& bench);
void addTypicalOperation(CLI::App& app, Bench& bench);
void addVerdictsOperation(CLI::App& app, Bench& bench);
void addFindOperation(CLI::App& app, Bench& bench);
void addLeaveOutOperation(CLI::App& app, Bench& bench);
void addFingerprintOperation(CLI::App& app, Bench& bench);
void addWorkersOperation(CLI::App& app, Bench& bench);
void addShardsOperation(CLI::App& app, Bench& bench);

// The program: reads the command line and runs the operation the user chose.

inline constexpr const char* kProgramName = "shapedb-bench";

/// The whole program except the signal handler: prints the operation's result or error and returns the
/// exit code (those of the `shapedb` command, client/cli/console.h). Never throws.
[[nodiscard]] int run(int argc, const char* const* argv, cli::Console& console,
                      const std::atomic<bool>& cancel);

}  // namespace shapedb::bench
