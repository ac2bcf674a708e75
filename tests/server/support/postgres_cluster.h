// SPDX-License-Identifier: GPL-3.0-or-later
// A PostgreSQL server of the test's own: in a folder below /tmp, on a Unix socket in it, gone at the end.
#pragma once

#include <cstdlib>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace shapedb::testing {

class PostgresCluster {
  public:
    /// The one of this process, started at the first call. Errors: kUnavailable (PostgreSQL is not installed,
    /// says what to do; or it does not start).
    static Result<PostgresCluster*> shared();

    ~PostgresCluster();
    PostgresCluster(const PostgresCluster&) = delete;
    PostgresCluster& operator=(const PostgresCluster&) = delete;

    /// An empty database with a name of its own, which is there until the end; returns its URI.
    [[nodiscard]] std::string createDatabase();
    /// Ends it as a crash would, and starts it again.
    void restart();

  private:
    PostgresCluster() = default;
    Result<void> start();
    /// One of PostgreSQL's programs, as the user that may run it. Returns whether it succeeded.
    bool run(const std::string& program, const std::string& arguments) const;
    std::string uriOf(const std::string& database) const;

    std::string binaries_;
    std::string folder_;
    bool isRunning_ = false;
    int databases_ = 0;
};

}  // namespace shapedb::testing

/// In SetUp of a fixture: `place` becomes the cluster of this process. Without PostgreSQL the test is
/// skipped, or fails where REQUIRE_POSTGRES is set, as in scripts/test.sh.
#define SHAPEDB_USE_POSTGRES(place)                                                                    \
    do {                                                                                               \
        const auto shared_ = shapedb::testing::PostgresCluster::shared();                              \
        if (!shared_ && std::getenv("REQUIRE_POSTGRES") != nullptr) FAIL() << shared_.error().message; \
        if (!shared_) GTEST_SKIP() << shared_.error().message;                                         \
        place = *shared_;                                                                              \
    } while (false)
