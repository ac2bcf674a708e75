// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/console.h"

#include <chrono>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shapedb::cli {
namespace {

TEST(Console, PrintsTextOrJsonNeverBoth) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    console.text("hello\n");
    console.document({{"a", 1}});
    EXPECT_EQ(out.str(), "hello\n");

    out.str("");
    console.setJson(true);
    console.text("hello\n");
    console.document({{"a", 1}});
    EXPECT_EQ(nlohmann::json::parse(out.str()), nlohmann::json({{"a", 1}}));
}

TEST(Console, ANoteIsOneLineWhateverNamesAreInIt) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    console.note("a\nb.ply: line 3\x1b[2J \xff");
    EXPECT_EQ(err.str(), "shapedb: a\\u000ab.ply: line 3\\u001b[2J \\ufffd\n");
}

TEST(Console, FailureIsANoteAndAJsonDocument) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
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
    Console console(out, err, {});
    console.setJson(true);
    console.document({{"done", true}});
    console.failure({ErrorCode::kInternal, "too late"});
    EXPECT_EQ(nlohmann::json::parse(out.str()), nlohmann::json({{"done", true}}));
}

TEST(Console, ShowsProgressOnlyOnATerminalAndErasesIt) {
    std::ostringstream out;
    std::ostringstream err;
    Console piped(out, err, {});
    piped.progress("read", 1, 2);
    EXPECT_EQ(err.str(), "");

    Console terminal(out, err, {true, false});
    terminal.progress("read", 1, 2);
    EXPECT_NE(err.str().find("read"), std::string::npos);
    EXPECT_NE(err.str().find("1 / 2"), std::string::npos);
    err.str("");
    terminal.note("careful");
    EXPECT_EQ(err.str(), "\r\x1b[Kshapedb: careful\n");
    EXPECT_EQ(out.str(), "");
}

TEST(Console, TellsThePaceOnceItIsKnown) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {true, false});
    console.progress("upload", 10, 100);
    EXPECT_EQ(err.str().find("left"), std::string::npos);
    std::this_thread::sleep_for(std::chrono::milliseconds(2100));
    console.progress("upload", 30, 100);
    EXPECT_NE(err.str().find("30 / 100  "), std::string::npos) << err.str();
    EXPECT_NE(err.str().find(" a second, "), std::string::npos) << err.str();
    EXPECT_NE(err.str().find(" s left"), std::string::npos) << err.str();
    err.str("");
    std::this_thread::sleep_for(std::chrono::milliseconds(110));
    console.progress("segment", 40, 100);
    EXPECT_EQ(err.str().find("left"), std::string::npos) << "another stage has its own pace: " << err.str();
}

TEST(Console, ColoursErrorsOnlyWhereAsked) {
    std::ostringstream out;
    std::ostringstream err;
    Console(out, err, {true, true}).note("careful");
    EXPECT_EQ(err.str(), "\x1b[1;31mshapedb:\x1b[0m careful\n");
    err.str("");
    Console(out, err, {true, false}).note("careful");
    EXPECT_EQ(err.str(), "shapedb: careful\n");
    EXPECT_FALSE(terminalAt(-1).bar) << "no terminal";
}

TEST(Console, JsonLinesHaveAnItemEach) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    console.item({{"a", 1}});
    EXPECT_EQ(out.str(), "");
    console.setForm(Console::Form::kJsonLines);
    console.item({{"a", 1}});
    console.item({{"b", {1, 2}}});
    console.text("hello\n");
    EXPECT_EQ(out.str(), "{\"a\":1}\n{\"b\":[1,2]}\n");
    console.failure({ErrorCode::kNotFound, "x"});
    EXPECT_NE(out.str().find("{\"error\":{\"message\":\"x\",\"name\":\"not_found\"}}\n"), std::string::npos);
}

TEST(Console, JsonSurvivesBytesThatAreNotUtf8) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    console.setJson(true);
    console.document({{"file", std::string("\xff\xfe.ply")}});
    EXPECT_FALSE(nlohmann::json::parse(out.str(), nullptr, false).is_discarded());
}

TEST(Console, FlushReportsAFailedWrite) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    EXPECT_TRUE(console.flush());
    out.setstate(std::ios::badbit);
    EXPECT_FALSE(console.flush());
}

}  // namespace
}  // namespace shapedb::cli
