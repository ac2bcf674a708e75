// SPDX-License-Identifier: GPL-3.0-or-later
// What the parts of `shapedb-bench load` share.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/load_run.h"
#include "bench/server_process.h"
#include "bench/signature_generator.h"
#include "client/api/client.h"

namespace shapedb::bench {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kWarmUpQueries = 3;
constexpr std::chrono::milliseconds kWarmUp{1'500};

[[nodiscard]] double since(Clock::time_point began);

[[nodiscard]] Result<client::Client> connect(const ServerProcess& server);

/// For a client that is refused at once instead of trying again.
[[nodiscard]] Result<client::Client> connectImpatiently(const ServerProcess& server);

[[nodiscard]] Result<ServerProcess> startServer(const LoadSettings& settings, const std::string& data,
                                                std::vector<std::string> flags = {});

[[nodiscard]] RunContext cancelledBy(const RunContext& context);

[[nodiscard]] Result<SignatureGenerator> makeGenerator(const LoadSettings& settings, std::uint64_t shapes,
                                                       const RunContext& context);

[[nodiscard]] Result<void> storeSignatures(const std::string& data, const SignatureGenerator& generator,
                                           std::uint64_t count, const LoadProgress& progress,
                                           const RunContext& context);

/// Queries that are not among the `stored` shapes.
[[nodiscard]] std::vector<std::string> makeQueries(const SignatureGenerator& generator, std::uint64_t stored);

/// Runs the queries in turn and appends the seconds each took.
[[nodiscard]] Result<void> ask(const client::Client& client, const std::vector<std::string>& queries,
                               std::uint32_t k, std::size_t count, double seconds, std::vector<double>& took,
                               const RunContext& context);

[[nodiscard]] Latencies latenciesOf(const std::vector<double>& took);

}  // namespace shapedb::bench
