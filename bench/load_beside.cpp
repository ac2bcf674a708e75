// SPDX-License-Identifier: GPL-3.0-or-later
// Searches beside others: large batches, and far more clients than the server can serve.
#include <atomic>
#include <thread>
#include <utility>

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "bench/batch_clients.h"
#include "bench/load_parts.h"
#include "bench/measuring.h"
#include "bench/stored_shapes.h"
#include "bench/work_loop.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

constexpr int kClientNice = 19;

/// Clients in numbers are on machines of their own: here they leave the processors to the server as far as
/// the system allows.
void yieldToServer() {
    thread_local const bool kOnce =
        ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kClientNice) == 0;
    static_cast<void>(kOnce);
}

/// A server with stored signatures, and queries that are not among them.
struct Subject {
    WorkDirectory directory;
    std::vector<std::string> queries;
    ServerProcess server;

    static Result<Subject> start(const LoadSettings& settings, std::uint64_t shapes,
                                 const LoadProgress& progress, const RunContext& context) {
        auto directory = WorkDirectory::create(settings.directory);
        RETURN_IF_ERROR(directory);
        const std::string data = directory->path() + "/data";
        const auto generator = makeGenerator(settings, shapes, context);
        RETURN_IF_ERROR(generator);
        RETURN_IF_ERROR(storeSignatures(data, *generator, shapes, progress, context));
        auto server = startServer(settings, data);
        RETURN_IF_ERROR(server);
        return Subject{std::move(*directory), makeQueries(*generator, shapes), std::move(*server)};
    }
};

/// As measureLatencyOf, beside clients that send large batches.
Result<BatchFigures> measureBatchesOf(const LoadSettings& settings, const Subject& subject,
                                      const client::Client& client, const LoadProgress& progress,
                                      const RunContext& context) {
    const std::vector<std::string>& queries = subject.queries;
    std::vector<double> idle, busy, warmUp;
    const std::size_t share = (settings.queries + settings.rounds - 1) / settings.rounds;
    const double seconds = settings.querySeconds / static_cast<double>(settings.rounds);
    RETURN_IF_ERROR(ask(client, queries, settings.k, kWarmUpQueries, seconds, warmUp, context));
    BatchFigures figures;
    double busySeconds = 0.0;
    for (std::size_t round = 0; round < settings.rounds; ++round) {
        progress("queries beside batches", round, settings.rounds);
        RETURN_IF_ERROR(ask(client, queries, settings.k, share, seconds, idle, context));
        auto clients = BatchClients::start(settings, subject.server, queries, subject.directory.path());
        RETURN_IF_ERROR(clients);
        std::this_thread::sleep_for(kWarmUp);
        const auto before = client.stats();
        const std::size_t asked = busy.size();
        const auto began = Clock::now();
        RETURN_IF_ERROR(ask(client, queries, settings.k, share, seconds, busy, context));
        busySeconds += since(began);
        const auto after = client.stats();
        RETURN_IF_ERROR(clients->requireRunning());
        if (!before || !after) return fail((before ? after : before).error());
        figures.searchesPerSecond +=
            static_cast<double>(after->searches - before->searches - (busy.size() - asked));
        {
            // What is interrupted ends before the next round.
            const BatchClients killed = std::move(*clients);
        }
        std::this_thread::sleep_for(kWarmUp);
    }
    const auto memory = subject.server.memory();
    RETURN_IF_ERROR(memory);
    figures.peak = memory->peak;
    figures.idle = latenciesOf(idle);
    figures.busy = latenciesOf(busy);
    if (figures.idle.p99 > 0.0) figures.p99Ratio = figures.busy.p99 / figures.idle.p99;
    if (busySeconds > 0.0) figures.searchesPerSecond /= busySeconds;
    return figures;
}

struct Goodput {
    double perSecond = 0.0;  ///< searches that were answered
    double refused = 0.0;    ///< a second
};

/// Far less than the half second that the server asks for.
constexpr std::chrono::milliseconds kComeBack{100};

/// `clients` search without a pause for `seconds`; those that are refused come back after kComeBack.
Result<Goodput> goodputOf(const LoadSettings& settings, const ServerProcess& server,
                          const std::vector<std::string>& queries, unsigned clients, double seconds) {
    client::SearchOptions options;
    options.k = settings.k;
    std::atomic<bool> stop{false};
    std::atomic<std::uint64_t> answered{0}, refused{0};
    std::vector<client::Client> connections;
    for (unsigned i = 0; i < clients; ++i) {
        auto one = connectImpatiently(server);
        RETURN_IF_ERROR(one);
        connections.push_back(std::move(*one));
    }
    std::atomic<unsigned> next{0};
    WorkLoop loop(clients, stop, [&](std::size_t i) -> Result<bool> {
        yieldToServer();
        thread_local unsigned mine = next.fetch_add(1);
        const auto reply =
            connections[mine % clients].searchBySignature(options, queries[i % queries.size()]);
        if (reply) {
            ++answered;
        } else if (reply.error().code == ErrorCode::kQueueFull) {
            ++refused;
            std::this_thread::sleep_for(kComeBack);
        } else if (!stop) {
            return fail(reply.error());
        }
        return true;
    });
    std::this_thread::sleep_for(kWarmUp);
    const std::uint64_t answeredBefore = answered, refusedBefore = refused;
    const auto began = Clock::now();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const double took = since(began);
    const Goodput goodput{static_cast<double>(answered - answeredBefore) / took,
                          static_cast<double>(refused - refusedBefore) / took};
    stop = true;
    RETURN_IF_ERROR(loop.finish());
    return goodput;
}

}  // namespace

Result<BatchFigures> measureBatches(const LoadSettings& settings, const LoadProgress& progress,
                                    const RunContext& context) {
    const auto subject = Subject::start(settings, settings.batchShapes, progress, context);
    RETURN_IF_ERROR(subject);
    const auto client = connect(subject->server);
    RETURN_IF_ERROR(client);
    return measureBatchesOf(settings, *subject, *client, progress, context);
}

Result<OverloadFigures> measureOverload(const LoadSettings& settings, const LoadProgress& progress,
                                        const RunContext& context) {
    const auto subject = Subject::start(settings, settings.overloadShapes, progress, context);
    RETURN_IF_ERROR(subject);
    OverloadFigures figures;
    std::vector<double> ratios;
    const double seconds = settings.querySeconds / static_cast<double>(settings.rounds) / 2.0;
    for (std::size_t round = 0; round < settings.rounds; ++round) {
        progress("overload", round, settings.rounds);
        RETURN_IF_ERROR(context.checkpoint());
        const auto peak =
            goodputOf(settings, subject->server, subject->queries, settings.peakClients, seconds);
        RETURN_IF_ERROR(peak);
        const auto before = subject->server.memory();
        RETURN_IF_ERROR(before);
        const auto over =
            goodputOf(settings, subject->server, subject->queries, 10 * settings.peakClients, seconds);
        RETURN_IF_ERROR(over);
        const auto after = subject->server.memory();
        RETURN_IF_ERROR(after);
        figures.peak += peak->perSecond / static_cast<double>(settings.rounds);
        figures.overloaded += over->perSecond / static_cast<double>(settings.rounds);
        figures.refused += over->refused / static_cast<double>(settings.rounds);
        figures.memoryBefore = before->resident;
        figures.memoryPeak = after->peak;
        ratios.push_back(over->perSecond / peak->perSecond);
    }
    figures.ratio = median(std::move(ratios));
    return figures;
}

}  // namespace shapedb::bench
