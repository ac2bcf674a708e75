// SPDX-License-Identifier: GPL-3.0-or-later
// Health and reflection, as load balancers and generic clients speak them; ServerInfo, Stats,
// and the command line of the program itself.
#include <fstream>
#include <set>

#include <signal.h>

#include "reflection.grpc.pb.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;
using grpc::health::v1::Health;
using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;
using StandardServices = LiveTest;

constexpr const char* kServices[] = {"shapedb.v1.ShapeService", "shapedb.v1.SearchService",
                                     "shapedb.v1.CollectionService", "shapedb.v1.AdminService",
                                     "shapedb.v1.AlignService"};

TEST_F(StandardServices, HealthCheckKnowsEachService) {
    HealthCheckRequest request;
    std::vector<const char*> names(std::begin(kServices), std::end(kServices));
    names.insert(names.end(), {"", "shapedb.segmentation", "shapedb.storage"});
    for (const char* service : names) {
        request.set_service(service);
        const auto reply = unary(*client.health, &Health::Stub::Check, request);
        ASSERT_TRUE(reply.ok()) << reply;
        EXPECT_EQ(reply.value.status(), HealthCheckResponse::SERVING) << service;
    }
    request.set_service("shapedb.v1.Nothing");
    EXPECT_EQ(unary(*client.health, &Health::Stub::Check, request).status.error_code(),
              StatusCode::NOT_FOUND);
}

TEST_F(StandardServices, HealthWatchSeesTheDrain) {
    const TemporaryDirectory own;
    ServerProcess other(own.path(), {"--shutdown-drain-seconds", "2"});
    Client otherClient(other.address());
    HealthCheckRequest request;
    request.set_service(kServices[0]);
    CallContext context;
    const auto reader = otherClient.health->Watch(&context, request);
    HealthCheckResponse response;
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.status(), HealthCheckResponse::SERVING);
    other.signal(SIGTERM);
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.status(), HealthCheckResponse::NOT_SERVING);
    EXPECT_EQ(other.wait(), 0) << "a health watcher does not delay the shutdown";
}

TEST_F(StandardServices, ReflectionListsAndDescribesTheServices) {
    using namespace grpc::reflection::v1alpha;
    const auto stub = ServerReflection::NewStub(client.channel);
    CallContext context;
    const auto stream = stub->ServerReflectionInfo(&context);
    ServerReflectionRequest request;
    ServerReflectionResponse response;
    request.set_list_services("*");
    ASSERT_TRUE(stream->Write(request));
    ASSERT_TRUE(stream->Read(&response));
    std::set<std::string> names;
    for (const auto& service : response.list_services_response().service()) names.insert(service.name());
    for (const char* service : kServices) EXPECT_EQ(names.count(service), 1u) << service;
    EXPECT_EQ(names.count("grpc.health.v1.Health"), 1u);

    request.set_file_containing_symbol(kServices[1]);
    ASSERT_TRUE(stream->Write(request));
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_GT(response.file_descriptor_response().file_descriptor_proto_size(), 0);
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StandardServices, ServerInfoTellsVersionAndLimits) {
    const auto reply = unary(*client.admin, &pb::AdminService::Stub::ServerInfo, pb::ServerInfoRequest());
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_FALSE(reply.value.version().empty());
    EXPECT_GE(reply.value.schema_version(), 1);
    EXPECT_GE(reply.value.ingest_threads(), 1u);
    EXPECT_EQ(reply.value.limits().max_points(), 200'000u);
    EXPECT_EQ(reply.value.limits().max_k(), 50u);
    EXPECT_EQ(reply.value.limits().max_batch(), 8u);
    EXPECT_EQ(reply.value.limits().max_chunk_bytes(), 1u << 20);
}

TEST_F(StandardServices, StatsCountShapesJobsAndSearches) {
    const auto before = statsOf(client);
    ASSERT_TRUE(addAndWait(client, collection, "k", dumbbell()).ok());
    ASSERT_TRUE(addAndWait(client, collection, "open", openSheet()).ok());
    ASSERT_TRUE(searchByScan(client, searchOptions(collection), dumbbell(2)).ok());
    const auto after = statsOf(client);
    EXPECT_EQ(after.shapes_ready(), before.shapes_ready() + 1);
    EXPECT_EQ(after.shapes_failed(), before.shapes_failed() + 1);
    EXPECT_EQ(after.cached_signatures(), before.cached_signatures() + 1);
    EXPECT_GT(after.cache_bytes(), before.cache_bytes());
    EXPECT_EQ(after.point_bytes(), before.point_bytes() + 12 * (2'000 + 1'600));
    EXPECT_GT(after.stored_point_bytes(), before.stored_point_bytes());
    EXPECT_EQ(after.searches(), before.searches() + 1);
    EXPECT_EQ(after.ingested(), before.ingested() + 1);
    EXPECT_EQ(after.queued_jobs(), 0u);
    EXPECT_GT(after.uptime_seconds(), 0.0);
    EXPECT_GT(after.database_bytes(), 0u);
}

TEST_F(StandardServices, EachCallIsOneLogLine) {
    ASSERT_TRUE(addAndWait(client, collection, "key with \"quotes\"", dumbbell()).ok());
    EXPECT_EQ(getShape(client, collection, "gone").error, "not_found");
    EXPECT_TRUE(eventually([&] { return server()->log().find("error=not_found") != std::string::npos; }));
    const std::string log = server()->log();
    EXPECT_NE(log.find("rpc=AddShape"), std::string::npos);
    EXPECT_NE(log.find("key=\"key with \\\"quotes\\\"\""), std::string::npos) << log;
    EXPECT_NE(log.find("points=2000 bytes=24000"), std::string::npos) << log;
}

TEST(Program, PrintsOneLineAndHelp) {
    const TemporaryDirectory directory;
    ServerProcess server(directory.path());
    EXPECT_EQ(server.banner(), "listening on " + server.address() + "\n");
    EXPECT_EQ(server.address().rfind("127.0.0.1:", 0), 0u);

    const Finished help = runServer({"--help"});
    EXPECT_EQ(help.exitCode, 0);
    EXPECT_NE(help.out.find("--ingest-threads"), std::string::npos);
    const Finished version = runServer({"--version"});
    EXPECT_EQ(version.exitCode, 0);
    EXPECT_EQ(version.out.rfind("shapedbd ", 0), 0u);
}

TEST(Program, CheckConfigNamesTheOriginOfValues) {
    const TemporaryDirectory directory;
    const std::string file = directory.path() + "/c.toml";
    std::ofstream(file) << "[limits]\nmax_k = 7\nmax_points = 1000\n";
    const Finished good = runServer({"--config", file, "--check-config", "--limits-max-points", "2000"},
                                    {{"SHAPEDB_SEARCH_THREADS", "3"}});
    EXPECT_EQ(good.exitCode, 0) << good.err;
    EXPECT_NE(good.out.find("limits.max_k = 7  # " + file + " line 2"), std::string::npos) << good.out;
    EXPECT_NE(good.out.find("limits.max_points = 2000  # flag --limits-max-points"), std::string::npos);
    EXPECT_NE(good.out.find("search.threads = 3  # environment SHAPEDB_SEARCH_THREADS"), std::string::npos);
    EXPECT_NE(good.out.find("limits.max_batch = 1000  # default"), std::string::npos);

    std::ofstream(file) << "[limits]\nmax_kk = 7\n";
    const Finished bad = runServer({"--config", file, "--check-config"});
    EXPECT_EQ(bad.exitCode, 1);
    EXPECT_NE(bad.err.find(file + " line 2: unknown key limits.max_kk"), std::string::npos) << bad.err;
    EXPECT_EQ(runServer({"--config", file}).exitCode, 2) << "nor does it serve";
    EXPECT_EQ(runServer({"--check-config", "--no-such-flag"}).exitCode, 1);
    EXPECT_EQ(runServer({"--no-such-flag"}).exitCode, 2);
}

TEST(Program, RefusesAnAddressOrDirectoryInUse) {
    const TemporaryDirectory directory;
    ServerProcess server(directory.path());
    const Finished sameAddress =
        runServer({"--listen", server.address(), "--data", directory.path() + "/other"});
    EXPECT_EQ(sameAddress.exitCode, 1);
    EXPECT_NE(sameAddress.err.find("cannot listen on " + server.address()), std::string::npos)
        << sameAddress.err;
    const Finished sameData = runServer({"--listen", "127.0.0.1:0", "--data", directory.path() + "/data"});
    EXPECT_EQ(sameData.exitCode, 1);
    EXPECT_NE(sameData.err.find("cannot start"), std::string::npos) << sameData.err;
    EXPECT_TRUE(sameData.out.empty());
}

TEST(Program, WritesJsonLogsToAFile) {
    const TemporaryDirectory directory;
    const std::string file = directory.path() + "/shapedbd.jsonl";
    {
        ServerProcess server(directory.path(), {"--log-format", "json", "--log-file", file});
        Client client(server.address());
        EXPECT_EQ(getShape(client, "", "no\"body").error, "not_found");
        server.signal(SIGINT);
        EXPECT_EQ(server.wait(), 0);
        EXPECT_EQ(server.log(), "");
    }
    const std::string log = readFile(file);
    EXPECT_NE(log.find(R"("rpc":"GetShape")"), std::string::npos) << log;
    EXPECT_NE(log.find(R"("key":"no\"body")"), std::string::npos) << log;
    EXPECT_EQ(log.front(), '{');
}

}  // namespace
}  // namespace shapedb::testing
