// SPDX-License-Identifier: GPL-3.0-or-later
// shapedbd: reads the configuration, serves until a signal (common/stop_signals.h), shuts down cleanly.
//
// Prints one line to standard output, `listening on HOST:PORT`, and if it serves HTTP a second one;
// everything else is logged. `shapedbd key` makes, lists and revokes API keys
// instead, `shapedbd man` prints the manual page. Exit codes: 0 success,
// 1 could not start or not shut down cleanly, 2 wrong configuration, 130 stopped at once by a second signal.

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "common/build_info.h"
#include "common/stop_signals.h"
#include "core/base/return_if_error.h"
#include "core/pipeline.h"
#include "server/config/command_line.h"
#include "server/config/load.h"
#include "server/config/settings.h"
#include "server/daemon.h"
#include "server/key_command.h"
#include "server/store/sqlite/sqlite_store.h"
#include "server/telemetry/logger.h"

namespace {

using namespace shapedb;

constexpr int kCannotServe = 1;
constexpr int kWrongConfiguration = 2;
constexpr int kStoppedAtOnce = 130;

int report(const Error& error, int exitCode) {
    std::fprintf(stderr, "shapedbd: %s: %s\n", errorCodeName(error.code), error.message.c_str());
    return exitCode;
}

Result<telemetry::LoggerPtr> openLog(const config::ServerConfig::Log& log) {
    const auto level = telemetry::levelFromName(log.level);
    RETURN_IF_ERROR(level);
    return telemetry::makeLogger({*level, log.format == "json", log.file});
}

/// Warns of settings that leave the server open to others.
void warnOfOpenDoors(const config::ServerConfig& config, const config::Endpoint& endpoint,
                     const telemetry::LoggerPtr& log) {
    if (endpoint.isLoopback()) return;
    if (!config::keysRequired(config)) {
        log->warn("anyone who can reach this port can read, change and delete everything, as configured",
                  {{"address", endpoint.text()}});
    } else if (config.tls.certificate.empty()) {
        log->warn("API keys travel unprotected, as configured", {{"address", endpoint.text()}});
    }
}

int serve(const config::ServerConfig& config) {
    const StopSignals signals;
    const auto log = openLog(config.log);
    if (!log) return report(log.error(), kWrongConfiguration);
    (*log)->info("starting", {{"version", std::string(config::version())},
                              {"build", std::string(buildInfo())},
                              {"data", config.data}});
    const auto describeScan = [](const PointCloud& points, const ShapeParameters& parameters,
                                 const RunContext& context) { return describe(points, parameters, context); };
    auto daemon = Daemon::start(config, *log, describeScan);
    if (!daemon) {
        (*log)->error("cannot start", telemetry::fieldsOf(daemon.error()));
        return kCannotServe;
    }
    const config::Endpoint& endpoint = (*daemon)->endpoint();
    warnOfOpenDoors(config, endpoint, *log);
    (*log)->info("listening", {{"address", endpoint.text()}});
    std::printf("listening on %s\n", endpoint.text().c_str());
    if (const auto http = (*daemon)->httpEndpoint()) {
        warnOfOpenDoors(config, *http, *log);
        std::printf("http on %s://%s\n", config.tls.certificate.empty() ? "http" : "https",
                    http->text().c_str());
    }
    std::fflush(stdout);

    const int received = signals.wait(kStoppedAtOnce);
    (*log)->info("draining", {{"signal", std::int64_t{received}}});
    const auto drained = (*daemon)->drain();
    if (!drained) (*log)->error("did not shut down cleanly", telemetry::fieldsOf(drained.error()));
    daemon->reset();
    (*log)->info("stopped");
    return drained ? 0 : kCannotServe;
}

int run(int argc, char** argv) {
    if (argc > 1 && std::string(argv[1]) == "key") return runKeyCommand(argc - 1, argv + 1);
    if (argc == 2 && std::string(argv[1]) == "man") {
        std::fputs(config::manPage().c_str(), stdout);
        return 0;
    }
    // The exit code is the answer of a check: 0, or 1 also for a mistake in the flags.
    const bool checking = std::any_of(argv, argv + argc,
                                      [](const char* flag) { return std::string(flag) == "--check-config"; });
    const int mistake = checking ? 1 : kWrongConfiguration;
    const auto commandLine = config::parseCommandLine(argc, argv);
    if (!commandLine) return report(commandLine.error(), mistake);
    if (commandLine->action == config::Action::kPrint) {
        std::fputs(commandLine->text.c_str(), stdout);
        return 0;
    }
    if (commandLine->action == config::Action::kPrintVersion) {
        std::printf("%s%s\n", commandLine->text.c_str(), buildInfo());
        return 0;
    }
    const auto loaded = config::load(*commandLine, config::processEnvironment());
    if (!loaded) return report(loaded.error(), mistake);
    if (commandLine->action == config::Action::kCheckConfig) {
        std::fputs(config::describe(*loaded).c_str(), stdout);
        return 0;
    }
    return serve(loaded->config);
}

}  // namespace

int main(int argc, char** argv) {
    // Beyond a limit of file sizes, writing fails with EFBIG, which is reported; the signal would end the
    // process.
    std::signal(SIGXFSZ, SIG_IGN);
    // gRPC would write endless lines to standard error about clients that break the protocol.
    setenv("GRPC_VERBOSITY", "NONE", 0);
    shapedb::store::stopCountingSqliteMemory();
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "shapedbd: %s\n", error.what());
        return kCannotServe;
    }
}
