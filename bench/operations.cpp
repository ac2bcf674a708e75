// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/operations.h"

#include <algorithm>
#include <exception>
#include <new>

#include <CLI/CLI.hpp>

#include "client/cli/console.h"

namespace shapedb::bench {

namespace {

int finish(cli::Console& console, int exitCode) {
    if (console.flush()) return exitCode;
    console.note("cannot write the result: standard output is closed or its device is full");
    return exitCode == cli::kOk ? cli::kBadData : exitCode;
}

/// Without the program's folder, so that figures of different machines compare.
std::string commandLine(int argc, const char* const* argv) {
    std::string text = kProgramName;
    for (int i = 1; i < argc; ++i) text += std::string(" ") + argv[i];
    return text;
}

int usageError(cli::Console& console, const CLI::App& app, const CLI::ParseError& error) {
    std::string command = app.get_name();
    for (const CLI::App* sub : app.get_subcommands()) command += " " + sub->get_name();
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    console.failure({ErrorCode::kInvalidArgument, message + " (see '" + command + " --help')"});
    return finish(console, cli::kUsage);
}

}  // namespace

int run(int argc, const char* const* argv, cli::Console& console, const std::atomic<bool>& cancel) {
    try {
        Bench bench{console, cancel, commandLine(argc, argv), {}};
        CLI::App app("Measures ShapeDB beside the alternatives.", kProgramName);
        app.set_version_flag("--version", std::string(kProgramName) + " " SHAPEDB_VERSION);
        app.require_subcommand(1);
        addRetrievalOperation(app, bench);
        addAlignOperation(app, bench);
        addViewsOperation(app, bench);
        addInteriorOperation(app, bench);
        addTopKOperation(app, bench);
        addLoadOperation(app, bench);
        addBatchClientsOperation(app, bench);
        addInstructionsOperation(app, bench);
        addJobOperation(app, bench);
        addSegmentOperation(app, bench);
        addTypicalOperation(app, bench);
        addVerdictsOperation(app, bench);
        addFindOperation(app, bench);
        addLeaveOutOperation(app, bench);
        addFingerprintOperation(app, bench);
        addWorkersOperation(app, bench);
        addShardsOperation(app, bench);
        try {
            app.parse(argc, argv);
        } catch (const CLI::CallForHelp&) {
            console.text(app.help());
            return finish(console, cli::kOk);
        } catch (const CLI::CallForVersion&) {
            console.text(app.version() + "\n");
            return finish(console, cli::kOk);
        } catch (const CLI::ParseError& error) {
            return usageError(console, app, error);
        }
        const Result<int> result = bench.action();
        console.clearProgress();
        if (result) return finish(console, *result);
        console.failure(result.error());
        return finish(console, cli::exitCodeOf(result.error().code));
    } catch (const std::bad_alloc&) {
        console.failure({ErrorCode::kOutOfMemory, "not enough memory"});
    } catch (const std::exception& e) {
        console.failure({ErrorCode::kInternal, std::string("unexpected failure: ") + e.what()});
    }
    return finish(console, cli::kDefect);
}

}  // namespace shapedb::bench
