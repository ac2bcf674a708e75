// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/support/postgres_cluster.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include "server/store/postgres/connection.h"

namespace shapedb::testing {

namespace {

constexpr char kUser[] = "postgres";

std::string findBinaries() {
    for (const char* version : {"17", "16", "15"}) {
        const std::string folder = std::string("/usr/lib/postgresql/") + version + "/bin";
        if (std::filesystem::exists(folder + "/initdb")) return folder;
    }
    return {};
}

}  // namespace

Result<PostgresCluster*> PostgresCluster::shared() {
    static std::unique_ptr<PostgresCluster> cluster;
    if (!cluster) {
        std::unique_ptr<PostgresCluster> made(new PostgresCluster);
        const auto started = made->start();
        if (!started) return fail(started.error());
        cluster = std::move(made);
    }
    return cluster.get();
}

Result<void> PostgresCluster::start() {
    binaries_ = findBinaries();
    if (binaries_.empty()) {
        return fail(ErrorCode::kUnavailable,
                    "PostgreSQL is not installed: scripts/install-deps.sh --postgres");
    }
    char name[] = "/tmp/shapedb-postgres-XXXXXX";
    if (::mkdtemp(name) == nullptr) return fail(ErrorCode::kUnavailable, "no folder below /tmp");
    folder_ = name;
    if (::geteuid() == 0) {
        const passwd* user = ::getpwnam(kUser);
        if (user == nullptr || ::chown(name, user->pw_uid, user->pw_gid) != 0) {
            return fail(ErrorCode::kUnavailable,
                        "PostgreSQL does not run as root, and there is no user postgres");
        }
    }
    // Nothing has to survive the machine. Small, because several of them may run at the same time.
    if (!run("initdb", "-D " + folder_ + "/data -U postgres -A trust -E UTF8 --locale=C -N") ||
        !run("pg_ctl",
             "-D " + folder_ + "/data -w -t 60 -l " + folder_ + "/log -o \"-k " + folder_ +
                 " -c listen_addresses= -c fsync=off -c shared_buffers=16MB -c max_connections=60\" start")) {
        return fail(ErrorCode::kUnavailable, "PostgreSQL does not start: see " + folder_ + "/log");
    }
    isRunning_ = true;
    return {};
}

PostgresCluster::~PostgresCluster() {
    if (isRunning_) run("pg_ctl", "-D " + folder_ + "/data -w -m immediate stop");
    if (folder_.empty()) return;
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
}

bool PostgresCluster::run(const std::string& program, const std::string& arguments) const {
    std::string command = binaries_ + "/" + program + " " + arguments + " >/dev/null 2>&1 </dev/null";
    if (::geteuid() == 0) command = std::string("cd / && runuser -u ") + kUser + " -- " + command;
    return std::system(command.c_str()) == 0;  // NOLINT(concurrency-mt-unsafe)
}

std::string PostgresCluster::uriOf(const std::string& database) const {
    return "host=" + folder_ + " user=postgres dbname=" + database;
}

std::string PostgresCluster::createDatabase() {
    const std::string name = "d" + std::to_string(::getpid()) + "_" + std::to_string(databases_++);
    const store::StatementTexts none;
    store::PostgresConnection({uriOf("postgres"), {}, std::chrono::seconds(60), "test"}, none)
        .execute("CREATE DATABASE " + name);
    return uriOf(name);
}

void PostgresCluster::restart() {
    EXPECT_TRUE(run("pg_ctl", "-D " + folder_ + "/data -w -m immediate restart"));
}

}  // namespace shapedb::testing
