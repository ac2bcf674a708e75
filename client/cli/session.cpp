// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/session.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/completion.h"
#include "client/cli/console.h"
#include "client/cli/usage.h"

namespace shapedb::cli {

namespace {

constexpr const char* kFooter =
    "Every command takes --json. 'shapedb help COMMAND' lists its flags.\n"
    "Exit codes: 0 done, 1 some items failed, 2 wrong usage, 3 bad file or scan,\n"
    "4 not found or wrong state, 5 server unavailable, 6 internal error, 130 interrupted.";

void addGlobalOptions(CLI::App& app, GlobalOptions& options) {
    auto* json = app.add_flag("--json", options.json, "Print one JSON document instead of text");
    app.add_flag("--json-lines", options.jsonLines,
                 "Print one line of JSON for each item as it arrives, or one for the whole result")
        ->excludes(json);
    app.add_option("--server", options.server, "Server address")
        ->envname("SHAPEDB_SERVER")
        ->default_str("127.0.0.1:7878")
        ->type_name("HOST:PORT");
    app.add_option("--key-file", options.keyFile,
                   "File with your API key [SHAPEDB_API_KEY_FILE, SHAPEDB_API_KEY]")
        ->type_name("FILE");
    app.add_flag("--tls", options.tls.enabled, "Protect the connection with TLS [SHAPEDB_TLS=1]");
    app.add_option("--tls-ca", options.tls.caFile,
                   "Certificates of the authorities that may have signed the server's certificate, PEM; "
                   "implies --tls [SHAPEDB_TLS_CA; those of the system]")
        ->type_name("FILE");
    app.add_option("--client-certificate", options.tls.certificateFile,
                   "For servers that ask for one, PEM [SHAPEDB_CLIENT_CERTIFICATE]")
        ->type_name("FILE");
    app.add_option("--client-key", options.tls.keyFile,
                   "The key of that certificate, PEM [SHAPEDB_CLIENT_KEY]")
        ->type_name("FILE");
    app.add_option("--server-name", options.tls.serverName,
                   "The name in the server's certificate, if it is not the host of --server")
        ->type_name("NAME");
    app.add_option("--timeout", options.timeoutSeconds,
                   "Give up after this long [a minute per call, an hour per scan, no limit for following]")
        ->check(aboveZero())
        ->type_name("SECONDS");
}

/// Global options may follow the command: `shapedb segment FILE --json`.
void letGlobalOptionsFollow(CLI::App& app) {
    for (CLI::App* sub : app.get_subcommands({})) {
        sub->fallthrough();
        letGlobalOptionsFollow(*sub);
    }
}

int finish(Console& console, int exitCode) {
    // `head` has what it wanted of the rest.
    if (console.flush() || console.readerLeft()) return exitCode;
    console.note("cannot write the result: standard output is closed or full");
    return exitCode == kOk ? kBadData : exitCode;
}

/// Messages in the words of the command line, while there is one.
class Wording {
  public:
    Wording(Console& console, const CLI::App& app) : console_(console) {
        console.setWording([&app](const std::string& message) { return inWordsOfFlags(app, message); });
    }
    ~Wording() { console_.setWording({}); }
    Wording(const Wording&) = delete;
    Wording& operator=(const Wording&) = delete;

  private:
    Console& console_;
};

int usageError(Console& console, const CLI::App& app, const CLI::ParseError& error) {
    console.failure({ErrorCode::kInvalidArgument, usageMessage(app, error)});
    return finish(console, kUsage);
}

/// How far the command was, and what is left of it.
Error interruption(Session& session) {
    const std::string done = session.console().progressText();
    return {ErrorCode::kCancelled,
            "interrupted" + (done.empty() ? "" : " (" + done + ")") + ": " + session.leftBehind};
}

int runAction(Session& session) {
    Console& console = session.console();
    const CommandResult result = session.action();
    console.clearProgress();
    if (result) return finish(console, *result);
    const bool interrupted = session.interrupted() && result.error().code == ErrorCode::kCancelled;
    console.failure(interrupted ? interruption(session) : result.error());
    return finish(console, exitCodeOf(result.error().code));
}

}  // namespace

RunContext Session::context(const std::string& what) {
    RunContext context;
    context.cancel = &cancel_;
    if (options_.timeoutSeconds && !deadline_) {
        // At most a year: the clock must not overflow.
        const std::chrono::duration<double> wait(std::min(*options_.timeoutSeconds, 86400.0 * 365.0));
        deadline_ = RunContext::Clock::now() + std::chrono::duration_cast<RunContext::Clock::duration>(wait);
    }
    if (deadline_) context.deadline = *deadline_;
    context.progress = [this, what](const char* stage, std::uint64_t done, std::uint64_t total) {
        console_.progress(what.empty() ? stage : what + ": " + stage, done, total);
    };
    return context;
}

int run(int argc, const char* const* argv, Console& console, const std::atomic<bool>& cancel,
        const std::string& build) {
    // Before parsing, so that a parse error is reported as JSON too.
    const auto given = [&](const char* flag) {
        return std::any_of(argv, argv + argc, [&](const char* a) { return std::strcmp(a, flag) == 0; });
    };
    console.setForm(given("--json-lines") ? Console::Form::kJsonLines
                    : given("--json")     ? Console::Form::kJson
                                          : Console::Form::kText);
    try {
        Session session(console, cancel);
        CLI::App app(
            "Finds 3D objects that look like your scan: stores scans on a ShapeDB server, searches them by "
            "shape, and cuts scans into parts. Scans may be noisy and need no mesh.",
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
        addAlignCommand(app, session);
        addShapeCommands(app, session);
        addChangeCommands(app, session);
        addCollectionCommands(app, session);
        addAdminCommands(app, session);
        addHealthCommand(app, session);
        addDuplicatesCommand(app, session);
        addMatchCommand(app, session);
        addReportCommand(app, session);
        addHelpCommands(app, session);
        if (argc > 1 && std::strcmp(argv[1], "__complete") == 0) {
            console.setForm(Console::Form::kText);
            console.ownText(completionText(app, {argv + 2, argv + argc}));
            return finish(console, kOk);
        }
        const Wording wording(console, app);
        letGlobalOptionsFollow(app);
        try {
            app.parse(argc, argv);
        } catch (const CLI::CallForHelp&) {
            console.setJson(false);
            console.text(app.help());
            return finish(console, kOk);
        } catch (const CLI::CallForVersion&) {
            console.setJson(false);
            console.text(app.version() + "\n" + (build.empty() ? "" : build + "\n"));
            return finish(console, kOk);
        } catch (const CLI::ParseError& error) {
            return usageError(console, app, error);
        }
        return runAction(session);
    } catch (const std::bad_alloc&) {
        console.failure({ErrorCode::kOutOfMemory, "not enough memory"});
    } catch (const std::exception& e) {
        console.failure({ErrorCode::kInternal, std::string("internal error: ") + e.what()});
    }
    return finish(console, kDefect);
}

}  // namespace shapedb::cli
