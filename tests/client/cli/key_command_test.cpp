// SPDX-License-Identifier: GPL-3.0-or-later
// API keys and TLS, as a user of the command meets them; against a real shapedbd.
#include <fstream>

#include "client/cli/console.h"
#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"
#include "tests/support/eventually.h"
#include "tests/support/self_signed.h"

namespace shapedb::cli {
namespace {

using nlohmann::json;
using testing::ServerProcess;

class KeyCommand : public CommandTest {
  protected:
    KeyCommand() {
        const auto made = testing::runServer(
            {"key", "create", "--data", folder() + "/data", "--role", "admin", "--name", "first"});
        EXPECT_EQ(made.exitCode, 0) << made.err;
        write("admin.key", made.out);
    }

    void serve(std::vector<std::string> flags) {
        flags.insert(flags.end(), {"--security-keys", "always", "--unix-socket", path("s.sock")});
        server_ = std::make_unique<ServerProcess>(folder(), flags);
    }
    CommandRun with(const std::map<std::string, std::string>& environment, std::vector<std::string> arguments,
                    bool network = true) {
        const std::string address = network ? server_->address() : "unix:" + path("s.sock");
        arguments.insert(arguments.end(), {"--timeout", "20", "--server", address});
        return runCommand(arguments, environment);
    }
    CommandRun asAdmin(const std::vector<std::string>& arguments) {
        return with({{"SHAPEDB_API_KEY_FILE", path("admin.key")}}, arguments);
    }

    std::unique_ptr<ServerProcess> server_;
};

TEST_F(KeyCommand, MakesListsAndRevokesKeys) {
    serve({});
    const auto made = asAdmin({"admin", "key", "create", "--name", "Ann", "--role", "reader", "--collection",
                               "default", "--valid-days", "2", "--scans-per-day", "9"});
    ASSERT_EQ(made.exitCode, 0) << made.err;
    ASSERT_EQ(made.out.size(), 8u + 16 + 1 + 64 + 1) << "the key alone, so that it can be sent to a file";
    write("ann.key", made.out);
    EXPECT_EQ(with({}, {"list", "--key-file", path("ann.key")}).exitCode, kOk);

    const auto listed = asAdmin({"admin", "key", "list", "--json"}).json()["keys"];
    ASSERT_EQ(listed.size(), 2u);
    EXPECT_EQ(listed[1]["name"], "Ann");
    EXPECT_EQ(listed[1]["role"], "reader");
    EXPECT_EQ(listed[1]["collections"], json::array({"default"}));
    EXPECT_EQ(listed[1]["scans_per_day"], 9);
    EXPECT_FALSE(listed[1].contains("secret"));
    const std::string id = listed[1]["id"];
    EXPECT_NE(asAdmin({"admin", "key", "list"}).out.find(id), std::string::npos);

    EXPECT_EQ(asAdmin({"admin", "key", "revoke", id}).exitCode, kOk);
    const auto refused = with({}, {"list", "--key-file", path("ann.key")});
    EXPECT_EQ(refused.exitCode, kWrongState);
    EXPECT_NE(refused.err.find("was revoked"), std::string::npos) << refused.err;
    EXPECT_EQ(asAdmin({"admin", "key", "revoke", id}).exitCode, kWrongState);
}

TEST_F(KeyCommand, ARepeatedAddSendsNothing) {
    serve({});
    const auto made = asAdmin({"admin", "key", "create", "--name", "Ann", "--role", "reader"});
    write("ann.key", made.out);
    for (const char* name : {"a", "b", "c"})
        writePoints("in/" + std::string(name) + ".xyz", dumbbellPoints(900));
    const std::vector<std::string> add = {"add", path("in"), "--base", path("in"), "--json"};
    ASSERT_EQ(asAdmin(add).exitCode, kOk);
    // Who may only read cannot send; what an interrupted run has sent need not be.
    const std::map<std::string, std::string> asReader = {{"SHAPEDB_API_KEY_FILE", path("ann.key")}};
    const auto again = with(asReader, add);
    EXPECT_EQ(again.exitCode, kOk) << again.err;
    EXPECT_EQ(again.json()["outcomes"], json({{"unchanged", 3}}));

    writePoints("in/b.xyz", dumbbellPoints(950));
    writePoints("in/d.xyz", dumbbellPoints(950));
    writePoints("in/e.xyz", dumbbellPoints(950));
    const auto refused = with(asReader, add);
    EXPECT_EQ(refused.exitCode, kWrongState) << "others must be sent";
    EXPECT_EQ(refused.json()["outcomes"], json({{"unchanged", 1}}));
    EXPECT_EQ(refused.json()["not_sent"].size(), 3u) << "what would be refused too is not tried";
    EXPECT_EQ(refused.json()["ended_by"]["name"], "permission_denied");
    EXPECT_NE(refused.err.find("3 of 5 scans not sent; the same command continues"), std::string::npos)
        << refused.err;
}

TEST_F(KeyCommand, TakesTheKeyFromAFileOrTheEnvironment) {
    serve({});
    const std::string key = testing::readFile(path("admin.key"));
    const std::string bare = key.substr(0, key.find('\n'));
    EXPECT_EQ(with({{"SHAPEDB_API_KEY", bare}}, {"list"}).exitCode, kOk);
    EXPECT_EQ(with({{"SHAPEDB_API_KEY", "nonsense"}}, {"list"}).exitCode, kWrongState);
    EXPECT_EQ(with({{"SHAPEDB_API_KEY", "nonsense"}}, {"list", "--key-file", path("admin.key")}).exitCode,
              kOk)
        << "the flag comes before the environment";
    EXPECT_EQ(with({}, {"list", "--key-file", write("crlf.key", bare + "\r\n")}).exitCode, kOk);
    const auto without = with({}, {"list", "--json"});
    EXPECT_EQ(without.exitCode, kWrongState);
    EXPECT_EQ(without.json()["error"]["name"], "unauthenticated");
    EXPECT_EQ(with({}, {"list", "--key-file", path("nowhere")}).exitCode, kBadData);
    EXPECT_EQ(with({}, {"list", "--key-file", write("empty.key", "\n")}).exitCode, kUsage);
    EXPECT_EQ(with({{"SHAPEDB_API_KEY", "a\nb"}}, {"list"}).exitCode, kUsage);
    EXPECT_EQ(with({}, {"admin", "stats"}, false).exitCode, kOk) << "the Unix socket wants none";
    EXPECT_EQ(with({}, {"health"}).exitCode, kOk) << "nor does health";
}

TEST_F(KeyCommand, NeverSendsTheKeyUnprotectedBeyondThisMachine) {
    for (const char* server :
         {"192.0.2.1", "shapes.example:7878", "[2001:db8::1]:7878", "dns:///shapes.example:1",
          "127.0.0.1.example:7878", "127.example:7878", "localhost.example:7878"}) {
        const auto run =
            runCommand({"list", "--server", server, "--key-file", path("admin.key"), "--timeout", "1"});
        EXPECT_EQ(run.exitCode, kUsage) << server;
        EXPECT_NE(run.err.find("TLS"), std::string::npos) << run.err;
    }
}

TEST_F(KeyCommand, AProxyOfTheEnvironmentSeesNothing) {
    serve({});
    std::map<std::string, std::string> environment = {{"SHAPEDB_API_KEY_FILE", path("admin.key")}};
    // Nobody listens there: a call that went to it would fail.
    for (const char* name : {"http_proxy", "https_proxy", "grpc_proxy"})
        environment[name] = "http://127.0.0.1:9";
    EXPECT_EQ(with(environment, {"list"}).exitCode, kOk);
}

TEST_F(KeyCommand, SpeaksTls) {
    const auto pair = testing::selfSigned("localhost"), other = testing::selfSigned("localhost");
    const std::string ca = write("server.pem", pair.certificate);
    serve({"--tls-certificate", ca, "--tls-key", write("server.key", pair.key)});
    const std::map<std::string, std::string> environment = {{"SHAPEDB_API_KEY_FILE", path("admin.key")},
                                                            {"SHAPEDB_TLS_CA", ca}};
    const std::vector<std::string> named = {"list", "--server-name", "localhost"};
    EXPECT_EQ(with(environment, named).exitCode, kOk);
    // Another server under that name; no TLS; the wrong name.
    const auto expectUnreachable = [&](const std::map<std::string, std::string>& in,
                                       std::vector<std::string> flags) {
        flags.insert(flags.end(), {"--timeout", "1", "--server", server_->address()});
        EXPECT_EQ(runCommand(flags, in).exitCode, kUnavailable);
    };
    expectUnreachable({{"SHAPEDB_TLS_CA", write("other.pem", other.certificate)}}, named);
    expectUnreachable({}, {"list"});
    expectUnreachable(environment, {"list", "--server-name", "shapes.example"});
    EXPECT_EQ(with({{"SHAPEDB_TLS_CA", path("nowhere")}}, named).exitCode, kBadData);
    EXPECT_EQ(with({{"SHAPEDB_CLIENT_KEY", ca}}, {"list"}).exitCode, kUsage) << "files for TLS without TLS";
}

}  // namespace
}  // namespace shapedb::cli
