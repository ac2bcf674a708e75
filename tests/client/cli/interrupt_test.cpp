// SPDX-License-Identifier: GPL-3.0-or-later
// What Ctrl-C leaves behind, as it is told: in one line, and with exit code 130.
#include <algorithm>
#include <atomic>
#include <sstream>

#include "client/cli/console.h"
#include "client/cli/session.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

using Interrupt = CommandTest;

/// The command after Ctrl-C was pressed at once.
CommandRun interrupted(const std::vector<std::string>& arguments) {
    std::vector<const char*> words = {"shapedb"};
    for (const std::string& one : arguments) words.push_back(one.c_str());
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    const std::atomic<bool> pressed{true};
    CommandRun done;
    done.exitCode = run(static_cast<int>(words.size()), words.data(), console, pressed);
    done.out = out.str();
    done.err = err.str();
    return done;
}

TEST_F(Interrupt, IsToldInOneLineOfPlainWords) {
    write("a/one.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    write("b/one.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    struct Case {
        std::vector<std::string> arguments;
        const char* words;
    };
    const Case cases[] = {
        {{"match", path("a"), path("b")}, "nothing was written"},
        {{"evaluate", path("a"), "--gallery", path("b")}, "nothing was written"},
        {{"segment", path("a/one.xyz")}, "nothing was written"},
        {{"duplicates"}, "nothing was written"},
        {{"report", path("a/one.xyz"), "-o", path("r.html")}, "nothing was written"},
        {{"query", path("a/one.xyz")}, "nothing was written"},
        {{"watch", "key"}, "follows it again"},
        {{"admin", "rebuild"}, "follows it again"},
        {{"admin", "copy", "127.0.0.1:1", "127.0.0.1:2"}, "nothing was written"},
        {{"delete", "key"}, "may have completed it"},
        {{"delete", "--filter", "a", "--yes"}, "stays deleted"},
        {{"collection", "create", "c"}, "may have completed it"},
    };
    for (const Case& one : cases) {
        const CommandRun run = interrupted(one.arguments);
        EXPECT_EQ(run.exitCode, kInterrupted) << one.arguments[0];
        EXPECT_EQ(run.err.rfind("shapedb: interrupted", 0), 0u) << one.arguments[0] << ": " << run.err;
        EXPECT_NE(run.err.find(one.words), std::string::npos) << one.arguments[0] << ": " << run.err;
        EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
        EXPECT_EQ(run.out, "");
    }
}

TEST_F(Interrupt, SaysHowFarItWas) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    EXPECT_EQ(console.progressText(), "");
    console.progress("compare", 1200, 3400);
    EXPECT_EQ(console.progressText(), "compare: 1,200 of 3,400");
    console.progress("list", 7, 0);
    EXPECT_EQ(console.progressText(), "list: 7");
    EXPECT_EQ(err.str(), "") << "no terminal, no bar";
}

}  // namespace
}  // namespace shapedb::cli
