#include "client/cli/console.h"

#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shapedb::cli {
namespace {

TEST(Console, PrintsTextOrJsonNeverBoth) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, false);
    console.text("hello\n");
    console.document({{"a", 1}});
    EXPECT_EQ(out.str(), "hello\n");

    out.str("");
    console.setJson(true);
    console.text("hello\n");
    console.document({{"a", 1}});
    EXPECT_EQ(nlohmann::json::parse(out.str()), nlohmann::json({{"a", 1}}));
}

TEST(Console, FailureIsANoteAndAJsonDocument) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, false);
    console.failure({ErrorCode::kNotFound, "no shape 'x'"});
    EXPECT_EQ(err.str(), "shapedb: no shape 'x'\n");
    EXPECT_EQ(out.str(), "");

    console.setJson(true);
    console.failure({ErrorCode::kNotFound, "no shape 'x'"});
    const auto document = nlohmann::json::parse(out.str());
    EXPECT_EQ(document["error"]["name"], "not_found");
    EXPECT_EQ(document["error"]["message"], "no shape 'x'");
}

TEST(Console, PrintsOnlyOneDocument) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, false);
    console.setJson(true);
    console.document({{"done", true}});
    console.failure({ErrorCode::kInternal, "too late"});
    EXPECT_EQ(nlohmann::json::parse(out.str()), nlohmann::json({{"done", true}}));
}

TEST(Console, ShowsProgressOnlyOnATerminalAndErasesIt) {
    std::ostringstream out;
    std::ostringstream err;
    Console piped(out, err, false);
    piped.progress("read", 1, 2);
    EXPECT_EQ(err.str(), "");

    Console terminal(out, err, true);
    terminal.progress("read", 1, 2);
    EXPECT_NE(err.str().find("read"), std::string::npos);
    EXPECT_NE(err.str().find("1 / 2"), std::string::npos);
    err.str("");
    terminal.note("careful");
    EXPECT_EQ(err.str(), "\r\x1b[Kshapedb: careful\n");
    EXPECT_EQ(out.str(), "");
}

TEST(Console, JsonSurvivesBytesThatAreNotUtf8) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, false);
    console.setJson(true);
    console.document({{"file", std::string("\xff\xfe.ply")}});
    EXPECT_FALSE(nlohmann::json::parse(out.str(), nullptr, false).is_discarded());
}

TEST(Console, FlushReportsAFailedWrite) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, false);
    EXPECT_TRUE(console.flush());
    out.setstate(std::ios::badbit);
    EXPECT_FALSE(console.flush());
}

}  // namespace
}  // namespace shapedb::cli
