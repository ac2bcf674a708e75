// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/request.h"

#include <gtest/gtest.h>

namespace shapedb::http {
namespace {

Head post(std::vector<std::pair<std::string, std::string>> fields) {
    Head head;
    head.method = "POST";
    head.target = "/shapedb.v1.ShapeService/GetShape?x=y";
    head.fields = std::move(fields);
    return head;
}

Head with(std::pair<std::string, std::string> field) {
    return post({{"host", "localhost:1"}, {"content-type", "application/json"}, std::move(field)});
}

unsigned statusOf(const OrFailure<void>& checked) { return checked ? 200 : checked.error().httpStatus(); }
unsigned statusOf(const OrFailure<CallForm>& checked) { return checked ? 200 : checked.error().httpStatus(); }

const Method kUnary{"/s/M", "", "", false, false};
const Method kStream{"/s/M", "", "", false, true};

TEST(Hosts, AreAddressesLocalhostAndNames) {
    const Hosts hosts = Hosts::named({"shapes.example"});
    for (const char* good : {"localhost", "LocalHost:80", "127.0.0.1:7879", "[::1]:7879", "[::1]", "10.1.2.3",
                             "shapes.example", "Shapes.Example:443"}) {
        EXPECT_TRUE(hosts.allow(good)) << good;
    }
    // A page of evil.example that lets its name lead here sends its own name.
    for (const char* bad :
         {"", "evil.example", "evil.example:7879", "localhost.evil.example", "127.0.0.1.evil.example",
          "xlocalhost", "[::1", "[evil]", "shapes.example.", "evil.example@localhost"}) {
        EXPECT_FALSE(hosts.allow(bad)) << bad;
    }
    EXPECT_TRUE(Hosts::any().allow("evil.example"));
}

TEST(CheckHead, TakesOneMeaningOnly) {
    const Hosts hosts = Hosts::named({});
    EXPECT_EQ(statusOf(checkHead(with({"a", "b"}), hosts)), 200u);
    EXPECT_EQ(statusOf(checkHead(with({"transfer-encoding", "chunked"}), hosts)), 200u);
    for (const char* coding : {"gzip, chunked", "chunked, chunked", "xchunked", "identity", ""}) {
        EXPECT_EQ(statusOf(checkHead(with({"transfer-encoding", coding}), hosts)), 501u) << coding;
    }
    EXPECT_EQ(statusOf(checkHead(with({"content-length", "12"}), hosts)), 200u);
    for (const char* length : {"1,1", "+1", "0x1", "1 1", "-1"}) {
        EXPECT_EQ(statusOf(checkHead(with({"content-length", length}), hosts)), 400u) << length;
    }
    EXPECT_EQ(statusOf(checkHead(with({"host", "localhost:2"}), hosts)), 400u);
    EXPECT_EQ(statusOf(checkHead(with({"content-type", "application/json"}), hosts)), 400u);
    EXPECT_EQ(statusOf(checkHead(post({{"host", "evil.example"}}), hosts)), 421u);
    EXPECT_EQ(statusOf(checkHead(post({}), hosts)), 400u);
    Head head = with({"a", "b"});
    for (const char* target : {"http://localhost/", "*", "", "localhost:80"}) {
        head.target = target;
        EXPECT_EQ(statusOf(checkHead(head, hosts)), 400u) << target;
    }
    head = with({"a", "b"});
    for (const int version : {9, 20, 12}) {
        head.version = version;
        EXPECT_EQ(statusOf(checkHead(head, hosts)), 505u) << version;
    }
}

TEST(FormOf, FollowsTheContentType) {
    const auto form = [](const char* type, const Method& method) {
        return formOf(post({{"host", "h"}, {"content-type", type}}), method);
    };
    EXPECT_TRUE(form("application/json", kUnary)->json);
    EXPECT_TRUE(form("Application/JSON; charset=utf-8", kUnary)->json);
    EXPECT_FALSE(form("application/proto", kUnary)->json);
    EXPECT_TRUE(form("application/connect+json", kStream)->json);
    EXPECT_TRUE(form("application/connect+proto", kStream)->enveloped);
    EXPECT_STREQ(form("application/connect+proto", kStream)->contentType(), "application/connect+proto");
    // What a page of another site may send unasked is among these.
    for (const char* bad : {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data",
                            "application/grpc", "application/jsonx", "text/plain; application/json"}) {
        EXPECT_EQ(statusOf(form(bad, kUnary)), 415u) << bad;
        EXPECT_EQ(statusOf(form(bad, kStream)), 415u) << bad;
    }
    EXPECT_EQ(statusOf(form("application/json", kStream)), 415u);
    EXPECT_EQ(statusOf(form("application/connect+json", kUnary)), 415u);
}

TEST(FormOf, RefusesCompressionAndOtherVersions) {
    EXPECT_EQ(statusOf(formOf(with({"content-encoding", "identity"}), kUnary)), 200u);
    for (const char* field : {"content-encoding", "connect-content-encoding"}) {
        EXPECT_EQ(statusOf(formOf(with({field, "gzip"}), kUnary)), 501u);
    }
    EXPECT_EQ(statusOf(formOf(with({"connect-protocol-version", "1"}), kUnary)), 200u);
    EXPECT_EQ(statusOf(formOf(with({"connect-protocol-version", "2"}), kUnary)), 400u);
}

TEST(FormOf, ReadsTheTimeout) {
    EXPECT_EQ(formOf(with({"connect-timeout-ms", "1500"}), kUnary)->timeout,
              std::chrono::milliseconds(1'500));
    EXPECT_EQ(formOf(with({"connect-timeout-ms", "9999999999"}), kUnary)->timeout,
              std::chrono::milliseconds(9'999'999'999));
    EXPECT_FALSE(formOf(with({"a", ""}), kUnary)->timeout);
    for (const char* bad : {"", "-1", "+1", "1.5", "1s", " 1", "12345678901", "0x1"}) {
        EXPECT_EQ(statusOf(formOf(with({"connect-timeout-ms", bad}), kUnary)), 400u) << bad;
    }
}

TEST(FormOf, TakesNoPageOfAnotherSite) {
    EXPECT_EQ(statusOf(formOf(with({"origin", "http://localhost:1"}), kUnary)), 200u);
    EXPECT_EQ(statusOf(formOf(with({"origin", "https://LOCALHOST:1"}), kUnary)), 200u);
    for (const char* other :
         {"null", "http://evil.example", "http://localhost:2", "localhost:1", "http://localhost:1.evil"}) {
        EXPECT_EQ(statusOf(formOf(with({"origin", other}), kUnary)), 403u) << other;
    }
}

// gRPC ends the process over a metadatum that is not printable.
TEST(FormOf, PassesOnWhatGrpcTakes) {
    EXPECT_EQ(formOf(with({"authorization", "Bearer abc"}), kUnary)->authorization, "Bearer abc");
    for (const char* bad : {"Bearer \x80", "Bearer\tabc", "\x7f", "Bearer \xc3\xa9"}) {
        EXPECT_EQ(statusOf(formOf(with({"authorization", bad}), kUnary)), 400u) << bad;
        const auto form = formOf(with({"traceparent", bad}), kUnary);
        ASSERT_TRUE(form);
        EXPECT_EQ(form->traceparent, "");
    }
}

}  // namespace
}  // namespace shapedb::http
