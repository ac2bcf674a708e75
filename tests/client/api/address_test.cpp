#include "client/api/address.h"

#include <gtest/gtest.h>

namespace shapedb::client {
namespace {

TEST(Address, AddsTheDefaultPort) {
    EXPECT_EQ(withDefaultPort("localhost"), "localhost:7878");
    EXPECT_EQ(withDefaultPort("10.0.0.1"), "10.0.0.1:7878");
    EXPECT_EQ(withDefaultPort("::1"), "[::1]:7878");
    EXPECT_EQ(withDefaultPort("[fe80::2]"), "[fe80::2]:7878");
}

TEST(Address, KeepsCompleteAddresses) {
    for (const char* address : {"localhost:1", "10.0.0.1:80", "[::1]:9", "unix:/run/shapedb.sock",
                                "unix:shapedb.sock", "dns:///host:5"}) {
        EXPECT_EQ(withDefaultPort(address), address);
    }
}

}  // namespace
}  // namespace shapedb::client
