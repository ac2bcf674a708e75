// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/load_parts.h"

#include <utility>

#include "bench/measuring.h"
#include "bench/stored_shapes.h"
#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"

namespace shapedb::bench {

namespace {

constexpr std::size_t kDistinctQueries = 64;
constexpr double kTail = 0.99;

}  // namespace

double since(Clock::time_point began) { return std::chrono::duration<double>(Clock::now() - began).count(); }

Result<client::Client> connect(const ServerProcess& server) {
    client::ClientOptions options;
    options.address = server.address();
    options.deadline = std::chrono::minutes(10);
    return client::Client::connect(options);
}

Result<client::Client> connectImpatiently(const ServerProcess& server) {
    client::ClientOptions options;
    options.address = server.address();
    options.retry.maxQueueAttempts = 1;
    return client::Client::connect(options);
}

Result<ServerProcess> startServer(const LoadSettings& settings, const std::string& data,
                                  std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--ingest-threads", std::to_string(settings.threads)});
    return ServerProcess::start(settings.server, data, flags);
}

RunContext cancelledBy(const RunContext& context) {
    RunContext plain;
    plain.cancel = context.cancel;
    return plain;
}

Result<SignatureGenerator> makeGenerator(const LoadSettings& settings, std::uint64_t shapes,
                                         const RunContext& context) {
    return SignatureGenerator::create(
        {Mixture::kPlain, shapes, settings.seed, settings.sourcePoints, settings.sourceMembers},
        cancelledBy(context));
}

Result<void> storeSignatures(const std::string& data, const SignatureGenerator& generator,
                             std::uint64_t count, const LoadProgress& progress, const RunContext& context) {
    RunContext reporting = context;
    reporting.progress = [&](const char*, std::uint64_t done, std::uint64_t total) {
        progress("storing signatures", done, total);
    };
    return fillDataDirectory(data, generator, count, reporting);
}

std::vector<std::string> makeQueries(const SignatureGenerator& generator, std::uint64_t stored) {
    std::vector<std::string> queries;
    for (std::size_t i = 0; i < kDistinctQueries; ++i)
        queries.push_back(encodeSignature(generator.make(stored + i)));
    return queries;
}

Result<void> ask(const client::Client& client, const std::vector<std::string>& queries, std::uint32_t k,
                 std::size_t count, double seconds, std::vector<double>& took, const RunContext& context) {
    client::SearchOptions options;
    options.k = k;
    const auto until = Clock::now() + std::chrono::duration<double>(seconds);
    for (std::size_t i = 0; i < count && Clock::now() < until; ++i) {
        const auto began = Clock::now();
        const auto reply =
            client.searchBySignature(options, queries[took.size() % queries.size()], cancelledBy(context));
        RETURN_IF_ERROR(reply);
        took.push_back(since(began));
    }
    return {};
}

Latencies latenciesOf(const std::vector<double>& took) {
    return {took.size(), median(took), percentile(took, kTail)};
}

}  // namespace shapedb::bench
