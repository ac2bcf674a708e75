// SPDX-License-Identifier: GPL-3.0-or-later
// Tests that share one running server; each works in a collection of its own.
#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "tests/integration/support/client.h"
#include "tests/integration/support/server_process.h"

namespace shapedb::testing {

class LiveTest : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        directory() = std::make_unique<TemporaryDirectory>();
        server() = std::make_unique<ServerProcess>(
            directory()->path(), std::vector<std::string>{"--limits-max-points", "200000", "--limits-max-k",
                                                          "50", "--limits-max-batch", "8"});
    }
    static void TearDownTestSuite() {
        server().reset();
        directory().reset();
    }

    LiveTest() : client(server()->address()) {
        collection = ::testing::UnitTest::GetInstance()->current_test_info()->name();
        const auto created = createCollection(client, collection);
        EXPECT_TRUE(created.ok()) << created;
    }

    static std::unique_ptr<TemporaryDirectory>& directory() {
        static std::unique_ptr<TemporaryDirectory> shared;
        return shared;
    }
    static std::unique_ptr<ServerProcess>& server() {
        static std::unique_ptr<ServerProcess> shared;
        return shared;
    }

    Client client;
    std::string collection;
};

}  // namespace shapedb::testing
