// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/channel.h"

#include <gtest/gtest.h>

namespace shapedb::client {
namespace {

TEST(Address, HasAPort) {
    const std::pair<const char*, const char*> cases[] = {
        {"localhost", "localhost:7878"},         {"10.0.0.1:80", "10.0.0.1:80"},    {"::1", "[::1]:7878"},
        {"fe80::1%eth0", "[fe80::1%eth0]:7878"}, {"[::1]", "[::1]:7878"},           {"[::1]:9", "[::1]:9"},
        {"unix:/run/a b", "unix:/run/a b"},      {"dns:///host:5", "dns:///host:5"}};
    for (const auto& [given, meant] : cases) {
        const auto address = checkedAddress(given);
        ASSERT_TRUE(address) << given << ": " << address.error().message;
        EXPECT_EQ(*address, meant);
    }
}

TEST(Address, AWrongOneIsReportedBeforeConnecting) {
    const std::pair<const char*, const char*> cases[] = {{"", "HOST:PORT"},
                                                         {"http://host:7879", "a web address"},
                                                         {"https://host", "TLS is switched on apart"},
                                                         {"host:99999", "'99999' is not a port"},
                                                         {"host:0", "not a port"},
                                                         {"host:", "no port after the colon"},
                                                         {"host:http", "'http' is not a port"},
                                                         {":7878", "no host"},
                                                         {"grpc://host:1", "grpc://"},
                                                         {"host:1/path", "more than a host"},
                                                         {"a b:1", "blank"},
                                                         {"[::1", "] is missing"},
                                                         {"[::1]x", "after ]"},
                                                         {"host:1:2", "more than one colon"},
                                                         {"unix:", "nothing follows"}};
    for (const auto& [given, why] : cases) {
        const auto address = checkedAddress(given);
        ASSERT_FALSE(address) << given;
        EXPECT_EQ(address.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(address.error().message.find(why), std::string::npos) << address.error().message;
        EXPECT_NE(address.error().message.find("HOST:PORT"), std::string::npos) << address.error().message;
    }
}

}  // namespace
}  // namespace shapedb::client
