// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/batch_clients.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <sstream>
#include <utility>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "bench/operations.h"
#include "bench/work_loop.h"
#include "client/api/client.h"
#include "client/cli/console.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

constexpr const char* kOperation = "batch-clients";
constexpr int kLeastPriority = 19;

struct Assignment {
    std::string server;
    std::string queries;  ///< file: JSON array of the bytes of each
    unsigned clients = 0;
    std::size_t batch = 0;
    std::uint32_t k = 0;
};

Result<std::vector<client::BatchQuery>> readBatch(const Assignment& assignment) {
    std::ifstream file(assignment.queries);
    const auto json = nlohmann::json::parse(file, nullptr, false);
    if (!json.is_array() || json.empty()) {
        return fail(ErrorCode::kFileNotReadable, assignment.queries + ": holds no queries");
    }
    std::vector<std::string> queries;
    for (const auto& bytes : json) {
        const auto one = bytes.get<std::vector<std::uint8_t>>();
        queries.emplace_back(one.begin(), one.end());
    }
    std::vector<client::BatchQuery> batch(assignment.batch);
    for (std::size_t i = 0; i < batch.size(); ++i) batch[i].signature = queries[i % queries.size()];
    return batch;
}

Result<int> sendBatches(const Assignment& assignment, const Bench& bench) {
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kLeastPriority));
    const auto batch = readBatch(assignment);
    RETURN_IF_ERROR(batch);
    client::SearchOptions options;
    options.k = assignment.k;
    std::atomic<bool> stop{false};
    WorkLoop loop(assignment.clients, stop, [&](std::size_t) -> Result<bool> {
        client::ClientOptions connection;
        connection.address = assignment.server;
        connection.deadline = std::chrono::minutes(10);
        const auto client = client::Client::connect(connection);
        RETURN_IF_ERROR(client);
        RETURN_IF_ERROR(client->searchBatch(options, *batch, bench.context()));
        return !bench.cancel;
    });
    RETURN_IF_ERROR(loop.finish());
    return cli::kOk;
}

}  // namespace

void addBatchClientsOperation(CLI::App& app, Bench& bench) {
    auto assignment = std::make_shared<Assignment>();
    CLI::App* command =
        app.add_subcommand(kOperation, "Sends SearchBatch without a pause; 'load' runs it")->group("");
    command->add_option("--server", assignment->server)->required();
    command->add_option("--queries", assignment->queries)->required();
    command->add_option("--clients", assignment->clients)->required();
    command->add_option("--batch", assignment->batch)->required();
    command->add_option("-k", assignment->k)->required();
    command->callback([assignment, &bench] {
        bench.action = [assignment, &bench] { return sendBatches(*assignment, bench); };
    });
}

Result<BatchClients> BatchClients::start(const LoadSettings& settings, const ServerProcess& server,
                                         const std::vector<std::string>& queries,
                                         const std::string& directory) {
    const std::string path = directory + "/queries.json";
    auto json = nlohmann::json::array();
    for (const std::string& query : queries)
        json.push_back(std::vector<std::uint8_t>(query.begin(), query.end()));
    std::ofstream file(path);
    file << json << std::flush;
    std::string log = directory + "/batch_clients.log";
    const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (!file || output < 0) return fail(ErrorCode::kFileNotWritable, directory + ": cannot be written");
    auto process =
        ChildProcess::start("/proc/self/exe",
                            {kOperation, "--server", server.address(), "--queries", path, "--clients",
                             std::to_string(settings.batchClients), "--batch",
                             std::to_string(settings.batchQueries), "-k", std::to_string(settings.k)},
                            {}, output, output);
    ::close(output);
    RETURN_IF_ERROR(process);
    return BatchClients(std::move(*process), std::move(log));
}

Result<void> BatchClients::requireRunning() const {
    if (process_.running()) return {};
    std::ostringstream said;
    said << std::ifstream(log_).rdbuf();
    return fail(ErrorCode::kUnavailable, "the clients of the batches have ended: " + said.str());
}

}  // namespace shapedb::bench
