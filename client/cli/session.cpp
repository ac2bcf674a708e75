#include "client/cli/session.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/exit_code.h"

namespace shapedb::cli {

namespace {

constexpr const char* kFooter =
    "Every command takes --json; 'shapedb COMMAND --help' tells the rest.\n"
    "Exit codes: 0 ok, 1 some items failed, 2 usage, 3 bad file or scan, 4 not found or wrong state,\n"
    "5 server unavailable, 6 internal, 130 interrupted.";

void addGlobalOptions(CLI::App& app, GlobalOptions& options) {
    app.add_flag("--json", options.json, "One JSON document on standard output instead of text");
    app.add_option("--server", options.server, "Address of the server")
        ->envname("SHAPEDB_SERVER")
        ->default_str("127.0.0.1:7878")
        ->type_name("HOST:PORT");
    app.add_option("--timeout", options.timeoutSeconds,
                   "Give up on the whole command after this long; without it a call to the server may take a "
                   "minute, sending a scan an hour, and following something as long as it takes")
        ->check(aboveZero())
        ->type_name("SECONDS");
}

/// Options of the program may follow the command: `shapedb segment FILE --json`.
void letGlobalOptionsFollow(CLI::App& app) {
    for (CLI::App* sub : app.get_subcommands({})) {
        sub->fallthrough();
        letGlobalOptionsFollow(*sub);
    }
}

int finish(Console& console, int exitCode) {
    if (console.flush()) return exitCode;
    console.note("cannot write the result: standard output is closed or its device is full");
    return exitCode == kOk ? kBadData : exitCode;
}

int usageError(Console& console, const CLI::App& app, const CLI::ParseError& error) {
    // The subcommand that was being read knows best which help to offer.
    std::string command = app.get_name();
    for (const CLI::App* at = &app; !at->get_subcommands().empty();) {
        at = at->get_subcommands().front();
        command += " " + at->get_name();
    }
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    console.failure({ErrorCode::kInvalidArgument, message + " (see '" + command + " --help')"});
    return finish(console, kUsage);
}

int runAction(Session& session) {
    Console& console = session.console();
    const CommandResult result = session.action();
    console.clearProgress();
    if (result) return finish(console, *result);
    console.failure(result.error());
    return finish(console, exitCodeOf(result.error().code));
}

}  // namespace

RunContext Session::context(const std::string& what) {
    RunContext context;
    context.cancel = &cancel_;
    if (options_.timeoutSeconds && !deadline_) {
        // A year is beyond any patience and still far from the clock's end.
        const std::chrono::duration<double> wait(std::min(*options_.timeoutSeconds, 86400.0 * 365.0));
        deadline_ = RunContext::Clock::now() + std::chrono::duration_cast<RunContext::Clock::duration>(wait);
    }
    if (deadline_) context.deadline = *deadline_;
    context.progress = [this, what](const char* stage, std::uint64_t done, std::uint64_t total) {
        console_.progress(what.empty() ? stage : what + ": " + stage, done, total);
    };
    return context;
}

int run(int argc, const char* const* argv, Console& console, const std::atomic<bool>& cancel) {
    // Known before parsing, so that an error of parsing is told in JSON too.
    console.setJson(
        std::any_of(argv, argv + argc, [](const char* a) { return std::strcmp(a, "--json") == 0; }));
    try {
        Session session(console, cancel);
        CLI::App app(
            "Shape retrieval for noisy 3D point clouds: segment scans, compare them, and ask a "
            "ShapeDB server for the most similar ones.",
            "shapedb");
        app.set_version_flag("--version", "shapedb " SHAPEDB_VERSION);
        app.footer(kFooter);
        app.require_subcommand(1);
        addGlobalOptions(app, session.options());
        addSegmentCommand(app, session);
        addSampleCommand(app, session);
        addEvaluateCommand(app, session);
        addAddCommand(app, session);
        addQueryCommand(app, session);
        addCompareCommand(app, session);
        addShapeCommands(app, session);
        addCollectionCommands(app, session);
        addAdminCommands(app, session);
        addHealthCommand(app, session);
        letGlobalOptionsFollow(app);
        try {
            app.parse(argc, argv);
        } catch (const CLI::CallForHelp&) {
            console.setJson(false);
            console.text(app.help());
            return finish(console, kOk);
        } catch (const CLI::CallForVersion&) {
            console.setJson(false);
            console.text(app.version() + "\n");
            return finish(console, kOk);
        } catch (const CLI::ParseError& error) {
            return usageError(console, app, error);
        }
        return runAction(session);
    } catch (const std::bad_alloc&) {
        console.failure({ErrorCode::kOutOfMemory, "not enough memory"});
    } catch (const std::exception& e) {
        console.failure({ErrorCode::kInternal, std::string("unexpected failure: ") + e.what()});
    }
    return finish(console, kDefect);
}

}  // namespace shapedb::cli
