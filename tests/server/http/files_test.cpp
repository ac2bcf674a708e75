// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/files.h"

#include <gtest/gtest.h>

#include "tests/server/http/fields.h"

namespace shapedb::http {
namespace {

Head get(const std::string& target, std::vector<std::pair<std::string, std::string>> fields = {}) {
    Head head;
    head.method = "GET";
    head.target = target;
    head.fields = std::move(fields);
    return head;
}

Response ask(const Head& head) { return fileResponse(head, embeddedFiles()); }

TEST(Files, TheIndexIsAtTheRoot) {
    const Response index = ask(get("/"));
    EXPECT_EQ(index.status, 200u);
    EXPECT_EQ(fieldOf(index, "Content-Type"), "text/html; charset=utf-8");
    EXPECT_NE(index.body.find("<title>ShapeDB"), std::string::npos);
    EXPECT_EQ(ask(get("/index.html")).body, index.body);
    EXPECT_EQ(ask(get("/?from=here")).body, index.body);
    EXPECT_NE(fieldOf(index, "Content-Security-Policy").find("default-src 'none'"), std::string::npos);
    EXPECT_EQ(fieldOf(index, "X-Content-Type-Options"), "nosniff");
}

TEST(Files, AreCompressedForWhoTakesIt) {
    const Response packed = ask(get("/", {{"accept-encoding", "br, gzip"}}));
    EXPECT_EQ(fieldOf(packed, "Content-Encoding"), "gzip");
    EXPECT_EQ(packed.body.substr(0, 2), "\x1f\x8b");
    for (const char* without : {"", "br", "gzip;q=0"}) {
        EXPECT_EQ(fieldOf(ask(get("/", {{"accept-encoding", without}})), "Content-Encoding"), "") << without;
    }
}

TEST(Files, AreNotSentAgain) {
    const Response first = ask(get("/"));
    const std::string tag = fieldOf(first, "ETag");
    ASSERT_GT(tag.size(), 10u);
    const Response again = ask(get("/", {{"if-none-match", tag}}));
    EXPECT_EQ(again.status, 304u);
    EXPECT_TRUE(again.body.empty());
    EXPECT_EQ(ask(get("/", {{"if-none-match", "\"other\""}})).status, 200u);
}

TEST(Files, OthersAreNotThere) {
    for (const char* path :
         {"/nothing", "/../server", "/index.html/", "/%2e%2e/", "//", "/style.css.gz", "/INDEX.HTML"}) {
        EXPECT_EQ(ask(get(path)).status, 404u) << path;
    }
}

TEST(Files, AreEachWhatTheyAreSaidToBe) {
    for (const EmbeddedFile& file : embeddedFiles()) {
        EXPECT_EQ(file.path.front(), '/');
        EXPECT_FALSE(file.contentType.empty()) << file.path;
        EXPECT_FALSE(ask(get(std::string(file.path))).body.empty()) << file.path;
    }
}

}  // namespace
}  // namespace shapedb::http
