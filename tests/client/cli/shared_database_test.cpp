// SPDX-License-Identifier: GPL-3.0-or-later
// Two servers with one database: what `shapedb` writes at one, it demands of the other.
#include <memory>
#include <string>
#include <vector>

#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"
#include "tests/server/support/postgres_cluster.h"

namespace shapedb::cli {
namespace {

using nlohmann::json;
using testing::ServerProcess;

class SharedDatabase : public CommandTest {
  protected:
    void SetUp() override {
        testing::PostgresCluster* postgres = nullptr;
        SHAPEDB_USE_POSTGRES(postgres);
        const std::string uri = postgres->createDatabase();
        for (const char* name : {"one", "two"}) {
            servers_.push_back(std::make_unique<ServerProcess>(
                path(name), std::vector<std::string>{"--store-engine", "postgres", "--postgres-uri", uri,
                                                     "--postgres-server-name", name}));
        }
    }
    CommandRun at(std::size_t server, std::vector<std::string> arguments) const {
        arguments.insert(arguments.end(), {"--server", servers_[server]->address(), "--json"});
        return runCommand(arguments);
    }

    std::vector<std::unique_ptr<ServerProcess>> servers_;
};

TEST_F(SharedDatabase, WhatWasAddedAtOneIsDemandedOfTheOther) {
    const std::string scan = writePoints("a.xyz", dumbbellPoints(1'000));
    const json added = at(0, {"add", scan, "--key", "a", "--wait"}).json();
    const std::int64_t change = added["added"][0]["change"];
    EXPECT_GT(change, 0);
    EXPECT_EQ(at(0, {"get", "a"}).json()["change"], change) << "that of the signature";
    const std::vector<std::string> query = {"query", scan, "--at-least"};
    std::vector<std::string> known = query;
    known.push_back(std::to_string(change));
    const json found = at(1, known).json();
    ASSERT_EQ(found["hits"].size(), 1u);
    EXPECT_EQ(found["covered"], 1.0);

    const json deleted = at(0, {"delete", "a"}).json();
    EXPECT_GT(deleted["deleted"][0]["change"], change);
    known.back() = std::to_string(deleted["deleted"][0]["change"].get<std::int64_t>());
    EXPECT_EQ(at(1, known).json()["hits"].size(), 0u);

    std::vector<std::string> never = query;
    never.insert(never.end(), {"1000000", "--timeout", "5"});
    const CommandRun refused = at(1, never);
    EXPECT_EQ(refused.exitCode, 5) << refused.out;
    EXPECT_NE(refused.err.find("--at-least"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace shapedb::cli
