// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench shards`: the same collection on one server with SQLite and on several that hold a part of it
// each. Are the answers the same bits, what does asking the others cost, how soon has a server loaded its
// part, and how soon does every server show what another has stored?
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/server_process.h"
#include "bench/stored_shapes.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"
#include "server/store/postgres/postgres_store.h"
#include "shapedb/v1/search_service.grpc.pb.h"
#include "shapedb/v1/shape_service.grpc.pb.h"

namespace shapedb::bench {

namespace {

namespace pb = shapedb::v1;
using Clock = std::chrono::steady_clock;
using Stub = pb::SearchService::Stub;

struct ShardsFlags {
    std::string database;
    std::string server;
    std::uint64_t signatures = 100'000;
    int queries = 1'000;
    int servers = 3;
    int replicas = 1;
    int writes = 200;
    std::uint64_t seed = 1;
};

double elapsedSince(Clock::time_point began) {
    return std::chrono::duration<double>(Clock::now() - began).count();
}

/// The content of a SQLite database, put into an empty one on PostgreSQL.
Result<void> moveTo(const std::string& uri, const std::string& file, const std::string& folder) {
    store::PostgresOptions options;
    options.uri = uri;
    options.serverName = "bench";
    options.lockPath = folder + "/lock";
    options.temporaryFolder = folder;
    options.patience = std::chrono::hours(1);
    const auto store = store::openPostgresStore(options);
    RETURN_IF_ERROR(store);
    return (*store)->restore(file, {}, [] { return Result<void>(); });
}

std::unique_ptr<Stub> searchesOf(const ServerProcess& server) {
    return pb::SearchService::NewStub(
        grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
}

/// Without what differs between two runs of the same search.
std::string comparable(pb::SearchResponse response) {
    response.clear_seconds_search();
    response.clear_scored();
    return response.SerializeAsString();
}

/// A search of some kind: all that a collection without surface points has.
pb::SearchOptions anyOptions(Random& random) {
    pb::SearchOptions options;
    options.set_k(1 + static_cast<std::uint32_t>(random.below(20)));
    if (random.below(4) == 0) options.set_threshold(0.3);
    if (random.below(4) == 0) options.set_filter("label!=class-1");
    if (random.below(8) == 0) options.set_keep_scale(true);
    if (random.below(16) == 0) options.set_partial(true);
    options.set_no_explanation(random.below(4) == 0);
    options.set_forbid_reflection(random.below(4) == 0);
    if (random.below(6) == 0) {
        options.set_group_by("label");
        options.set_per_group(static_cast<std::uint32_t>(random.below(4)));
    }
    return options;
}

struct Answer {
    std::string bytes;  ///< empty: it failed
    double seconds = 0.0;
    std::string error;
};

Answer ask(Stub& stub, const pb::SearchOptions& options, const std::string& key,
           const std::string& signature) {
    grpc::ClientContext context;
    pb::SearchResponse response;
    const auto began = Clock::now();
    grpc::Status status;
    if (signature.empty()) {
        pb::SearchByKeyRequest request;
        *request.mutable_options() = options;
        request.set_key(key);
        status = stub.SearchByKey(&context, request, &response);
    } else {
        pb::SearchBySignatureRequest request;
        *request.mutable_options() = options;
        request.set_signature(signature);
        status = stub.SearchBySignature(&context, request, &response);
    }
    const double seconds = elapsedSince(began);
    if (!status.ok()) return {{}, seconds, status.error_message()};
    return {comparable(std::move(response)), seconds, {}};
}

Result<void> compareAnswers(const ServerProcess& alone, const std::vector<ServerProcess>& servers,
                            const SignatureGenerator& generator, const ShardsFlags& flags, Bench& bench) {
    const auto one = searchesOf(alone);
    std::vector<std::unique_ptr<Stub>> several;
    for (const ServerProcess& server : servers) several.push_back(searchesOf(server));
    Random random(flags.seed);
    std::vector<double> local;
    std::vector<double> gathered;
    std::vector<double> added;
    int different = 0;
    for (int i = 0; i < flags.queries; ++i) {
        RETURN_IF_ERROR(bench.context().checkpoint());
        const auto options = anyOptions(random);
        const std::string key = "shape-" + std::to_string(random.below(flags.signatures));
        std::string signature;
        if (random.below(3) == 0)
            signature = encodeSignature(generator.make(flags.signatures + random.below(10'000)));
        const Answer expected = ask(*one, options, key, signature);
        const Answer found =
            ask(*several[static_cast<std::size_t>(i) % several.size()], options, key, signature);
        if (found.bytes != expected.bytes || found.bytes.empty()) {
            ++different;
            bench.console.text("query " + std::to_string(i) + " differs: " + found.error + "\n");
        }
        local.push_back(1e3 * expected.seconds);
        gathered.push_back(1e3 * found.seconds);
        added.push_back(1e3 * (found.seconds - expected.seconds));
    }
    const auto line = [&](const char* what, const std::vector<double>& ms) {
        bench.console.text(what + numberText("  p50 %7.2f", percentile(ms, 0.5)) +
                           numberText("  p99 %7.2f ms\n", percentile(ms, 0.99)));
    };
    bench.console.text(std::to_string(flags.queries) + " searches of all kinds, " +
                       std::to_string(different) + " answers differ\n");
    line("one server     ", local);
    line("several servers", gathered);
    line("added by these ", added);
    if (different == 0) return {};
    return fail(ErrorCode::kInternal, std::to_string(different) + " answers differ");
}

/// How soon a metadata change by one server is found by a search of each other.
Result<void> measureVisibility(const std::vector<ServerProcess>& servers, const ShardsFlags& flags,
                               Bench& bench) {
    const auto shapes = pb::ShapeService::NewStub(
        grpc::CreateChannel(servers.front().address(), grpc::InsecureChannelCredentials()));
    std::vector<std::unique_ptr<Stub>> others;
    for (std::size_t i = 1; i < servers.size(); ++i) others.push_back(searchesOf(servers[i]));
    std::vector<double> waits;
    for (int i = 0; i < flags.writes && !others.empty(); ++i) {
        RETURN_IF_ERROR(bench.context().checkpoint());
        const std::string mark = "mark-" + std::to_string(i);
        pb::UpdateMetadataRequest patch;
        patch.set_key("shape-" + std::to_string(i));
        (*patch.mutable_change()->mutable_set())["mark"] = mark;
        grpc::ClientContext context;
        pb::UpdateMetadataResponse patched;
        const auto status = shapes->UpdateMetadata(&context, patch, &patched);
        if (!status.ok()) return fail(ErrorCode::kUnavailable, status.error_message());
        const auto acknowledged = Clock::now();
        for (const auto& other : others) {
            while (true) {
                grpc::ClientContext search;
                pb::SearchByKeyRequest request;
                request.mutable_options()->set_k(1);
                request.mutable_options()->set_filter("mark=" + mark);
                request.mutable_options()->set_no_explanation(true);
                request.set_key("shape-" + std::to_string(i));
                request.set_include_self(true);
                pb::SearchResponse response;
                if (other->SearchByKey(&search, request, &response).ok() && response.hits_size() == 1) break;
            }
            waits.push_back(1e3 * elapsedSince(acknowledged));
        }
    }
    bench.console.text(std::to_string(waits.size()) + " looks at what another server wrote: shown after p50" +
                       numberText(" %.1f", percentile(waits, 0.5)) +
                       numberText(", p99 %.1f", percentile(waits, 0.99)) + " ms, the search included\n");
    return {};
}

std::vector<std::string> flagsOf(const ShardsFlags& flags, int number) {
    return {"--store-engine",
            "postgres",
            "--postgres-uri",
            flags.database,
            "--postgres-server-name",
            "bench-" + std::to_string(number),
            "--cluster-replicas",
            std::to_string(flags.replicas),
            "--log-level",
            "warn"};
}

/// All at once; each listens when its part, or all parts, have a server.
Result<std::vector<ServerProcess>> startServers(const ShardsFlags& flags, const std::string& folder,
                                                Bench& bench) {
    std::vector<std::optional<Result<ServerProcess>>> started(static_cast<std::size_t>(flags.servers));
    std::vector<double> seconds(started.size());
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < started.size(); ++i) {
        threads.emplace_back([&, i] {
            const auto began = Clock::now();
            started[i].emplace(ServerProcess::start(flags.server, folder + "/server" + std::to_string(i),
                                                    flagsOf(flags, static_cast<int>(i))));
            seconds[i] = elapsedSince(began);
        });
    }
    for (std::thread& thread : threads) thread.join();
    std::vector<ServerProcess> servers;
    for (auto& server : started) {
        RETURN_IF_ERROR(*server);
        servers.push_back(std::move(**server));
    }
    bench.console.text(std::to_string(flags.servers) + " servers started at once: all serve after" +
                       numberText(" %.2f s\n", *std::max_element(seconds.begin(), seconds.end())));
    for (std::size_t i = 0; i < servers.size(); ++i) {
        const auto memory = servers[i].memory();
        RETURN_IF_ERROR(memory);
        bench.console.text("server " + std::to_string(i) +
                           numberText(": %.0f MB\n", 1e-6 * static_cast<double>(memory->resident)));
    }
    return servers;
}

Result<int> runShards(const ShardsFlags& flags, Bench& bench) {
    auto folder = WorkDirectory::create("");
    RETURN_IF_ERROR(folder);
    SignatureGenerator::Options options;
    options.expected = flags.signatures;
    options.seed = flags.seed;
    const auto generator = SignatureGenerator::create(options, bench.context());
    RETURN_IF_ERROR(generator);
    bench.console.text(describe(environment()) + "\n" + bench.command + "\n" +
                       std::to_string(flags.signatures) + " signatures, seed " + std::to_string(flags.seed) +
                       "\n");
    const std::string aloneData = folder->path() + "/alone";
    RETURN_IF_ERROR(fillDataDirectory(aloneData, *generator, flags.signatures, bench.context()));
    const auto began = Clock::now();
    RETURN_IF_ERROR(moveTo(flags.database, aloneData + "/shapedb.sqlite", folder->path()));
    bench.console.text("moved to PostgreSQL in" + numberText(" %.0f s\n", elapsedSince(began)));
    auto servers = startServers(flags, folder->path(), bench);
    RETURN_IF_ERROR(servers);
    {
        const auto aloneBegan = Clock::now();
        auto alone = ServerProcess::start(flags.server, aloneData, {"--log-level", "warn"});
        RETURN_IF_ERROR(alone);
        bench.console.text("one server with SQLite started in" +
                           numberText(" %.2f s\n", elapsedSince(aloneBegan)));
        RETURN_IF_ERROR(compareAnswers(*alone, *servers, *generator, flags, bench));
    }
    RETURN_IF_ERROR(measureVisibility(*servers, flags, bench));
    return cli::kOk;
}

}  // namespace

void addShardsOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<ShardsFlags>();
    CLI::App* command = app.add_subcommand(
        "shards", "Do several servers that hold a part each answer as one with all, and what does it cost?");
    command->add_option("--database", flags->database, "URI of an empty database on PostgreSQL")->required();
    command->add_option("--server", flags->server, "The program to measure [shapedbd beside this one]");
    command->add_option("--signatures", flags->signatures, "In the collection")
        ->check(CLI::Range(std::uint64_t{100}, std::uint64_t{100'000'000}));
    command->add_option("--queries", flags->queries, "Compared")->check(CLI::Range(0, 1'000'000));
    command->add_option("--servers", flags->servers, "That share the database")->check(CLI::Range(1, 16));
    command->add_option("--replicas", flags->replicas, "Servers that hold each part; 0: each holds all")
        ->check(CLI::Range(0, 16));
    command->add_option("--writes", flags->writes, "Looked for on the other servers")
        ->check(CLI::Range(0, 100));
    command->add_option("--seed", flags->seed, "Of the signatures and the queries");
    command->callback([&bench, flags] {
        bench.action = [&bench, flags] {
            if (flags->server.empty()) flags->server = serverBeside();
            return runShards(*flags, bench);
        };
    });
}

}  // namespace shapedb::bench
