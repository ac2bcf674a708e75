// The operations of shapedb-bench. A new one is a source file with its function here, called in
// program.cpp.
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

/// What an operation gets: where its words go, and how it is stopped.
struct Bench {
    /// Where text for people goes, progress and notes.
    cli::Console& console;
    const std::atomic<bool>& cancel;  ///< set by Ctrl-C
    std::string command;              ///< as the user wrote it, program first

    /// Set by the subcommand the user named; run after the whole command line was read. Its value
    /// is the exit code.
    std::function<Result<int>()> action;

    [[nodiscard]] RunContext context() const {
        RunContext context;
        context.cancel = &cancel;
        return context;
    }
};

/// Each adds its subcommand to `app`; both must live as long as the program.
void addRetrievalOperation(CLI::App& app, Bench& bench);
void addInteriorOperation(CLI::App& app, Bench& bench);
void addTopKOperation(CLI::App& app, Bench& bench);
void addLoadOperation(CLI::App& app, Bench& bench);
void addInstructionsOperation(CLI::App& app, Bench& bench);
void addJobOperation(CLI::App& app, Bench& bench);
void addSegmentOperation(CLI::App& app, Bench& bench);
void addTypicalOperation(CLI::App& app, Bench& bench);
void addFingerprintOperation(CLI::App& app, Bench& bench);

}  // namespace shapedb::bench
