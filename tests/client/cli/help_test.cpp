// SPDX-License-Identifier: GPL-3.0-or-later
// What the program says of itself: help, completion, manual pages, and what was probably meant.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "client/cli/usage.h"
#include "common/nearest_name.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;

using Help = CommandTest;

::testing::AssertionResult contains(const std::string& text, const std::string& words) {
    if (text.find(words) != std::string::npos) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "no '" << words << "' in:\n" << text;
}

/// What shells are told may follow.
std::string completionsOf(std::vector<std::string> words) {
    words.insert(words.begin(), "__complete");
    return runCommand(words).out;
}

TEST_F(Help, WhatWasProbablyMeantIsTold) {
    struct Case {
        std::vector<std::string> arguments;
        const char* told;
    };
    const std::vector<Case> cases = {
        {{"gett"}, "unknown command 'gett': did you mean 'get'? (see 'shapedb --help')"},
        {{"gett", "x", "--json"}, "unknown command 'gett': did you mean 'get'?"},
        {{"delte", "x"}, "did you mean 'delete'?"},
        {{"stats"}, "unknown command 'stats': did you mean 'admin stats'?"},
        {{"admin", "stat"}, "unknown command 'stat': did you mean 'stats'? (see 'shapedb admin --help')"},
        {{"admin", "key", "creat", "--name", "x"}, "unknown command 'creat': did you mean 'create'?"},
        {{"xyzzy"}, "unknown command 'xyzzy' (see"},
        {{"query", "a.ply", "--thresold", "0.5"},
         "unknown option '--thresold': did you mean '--threshold'? (see 'shapedb query --help')"},
        {{"query", "a.ply", "--treshold=0.5"}, "unknown option '--treshold': did you mean '--threshold'?"},
        {{"list", "--sever", "x"}, "did you mean '--server'?"},
        {{"segment", "a.ply", "--deep-angel", "3"}, "did you mean '--deep-angle'?"},
        {{"list", "--xyzzy"}, "unknown option '--xyzzy' (see"},
        {{"help", "quer"}, "has no command 'quer': did you mean 'query'?"},
    };
    for (const Case& one : cases) {
        const CommandRun run = runCommand(one.arguments);
        EXPECT_EQ(run.exitCode, 2) << one.told;
        EXPECT_TRUE(contains(run.err, one.told));
    }
}

TEST(NearestName, IsNearOrNone) {
    EXPECT_EQ(nearestName("qurey", {"query", "queue"}), "query");
    EXPECT_EQ(nearestName("--thresh", {"--threshold", "--threads"}), "--threshold");
    EXPECT_EQ(nearestName("zzz", {"query"}), "");
    EXPECT_EQ(nearestName("", {"query"}), "");
}

TEST_F(Help, HelpShowsTheCommandThatWordsName) {
    EXPECT_EQ(runCommand({"help"}).exitCode, 0);
    EXPECT_TRUE(contains(runCommand({"help"}).out, "Usage: shapedb"));
    EXPECT_TRUE(contains(runCommand({"help", "query"}).out, "--threshold"));
    const std::string create = runCommand({"help", "admin", "key", "create"}).out;
    EXPECT_TRUE(contains(create, "Usage: shapedb admin key create"));
    EXPECT_TRUE(contains(create, "--valid-days"));
}

TEST_F(Help, EveryCommandAndFlagCompletes) {
    EXPECT_TRUE(contains(completionsOf({"dup"}), "duplicates\tFind the pairs"));
    EXPECT_TRUE(contains(completionsOf({""}), "query\t"));
    EXPECT_TRUE(contains(completionsOf({"admin", "key", ""}), "revoke\t"));
    EXPECT_TRUE(contains(completionsOf({"list", "--st"}), "--state\tOnly shapes in this state"));
    EXPECT_TRUE(contains(completionsOf({"list", "--js"}), "--json-lines\t")) << "options of the program";
    EXPECT_TRUE(contains(completionsOf({"segment", "a.ply", "--deep"}), "--deep-angle\t")) << "of a group";
    EXPECT_EQ(completionsOf({"list", "--state", "r"}), "ready\t\n");
    EXPECT_EQ(completionsOf({"list", "--server", ""}), "") << "a value that only its user knows";
    EXPECT_TRUE(contains(completionsOf({"query", ""}), ":files\n"));
    EXPECT_TRUE(contains(completionsOf({"query", "a.ply", "-o", ""}), ":files\n"));
    EXPECT_EQ(completionsOf({"completion", "b"}), "bash\t\n");
    EXPECT_EQ(completionsOf({"list", "--json"}).find("error"), std::string::npos) << "words are not options";
    EXPECT_EQ(completionsOf({}).find("__complete"), std::string::npos);
    // Nothing that --help shows is missing.
    for (const char* command : {"query", "add", "align", "report", "match"}) {
        const std::string help = runCommand({"help", command}).out;
        const std::string offered = completionsOf({command, "--"});
        for (std::size_t at = 0; (at = help.find("  --", at)) != std::string::npos;) {
            at += 2;
            const std::string flag = help.substr(at, help.find_first_of(" ,\n", at) - at);
            EXPECT_TRUE(contains(offered, flag + "\t")) << command;
        }
    }
}

/// Of a shell, with shapedb on its path; empty if this machine has no such shell.
std::string outputOf(const std::string& shell, const std::string& script) {
    if (std::system(("command -v " + shell + " >/dev/null").c_str()) != 0) return {};
    const std::string path = fs::path(SHAPEDB_PATH).parent_path().string();
    const std::string line = "PATH='" + path + "':$PATH " + shell + " -c '" + script + "' 2>&1";
    std::string out;
    FILE* pipe = ::popen(line.c_str(), "r");
    char buffer[4096];
    for (std::size_t size; (size = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.append(buffer, size);
    ::pclose(pipe);
    return out.empty() ? "nothing" : out;
}

/// Types into a zsh at a terminal, and prints what it makes of the tabs.
constexpr const char* kPressTab = R"sh(
zmodload zsh/zpty
export TERM=dumb
zpty shell zsh -f -i
await() {
    local part seen=
    repeat 200; do
        zpty -r -t shell part && seen+=$part
        [[ $seen == *$1* ]] && break
        sleep 0.1
    done
    print -r -- "$seen"
}
zpty -w shell 'PS1=; autoload -Uz compinit; compinit -u -D; eval "$(shapedb completion zsh)"; echo rea""dy'
await ready >/dev/null
zpty -w -n shell $'shapedb admin sta\t'
await 'ts '
zpty -w -n shell $'\025shapedb collection create --profile \t\t'
await 'paper'
zpty -d shell
)sh";

TEST_F(Help, ShellsLoadTheirCompletion) {
    EXPECT_EQ(
        outputOf(
            "bash",
            "eval \"$(shapedb completion bash)\"; compopt() { echo files; }; COMP_WORDS=(shapedb admin st); "
            "COMP_CWORD=2; _shapedb; echo ${COMPREPLY[@]}; COMP_WORDS=(shapedb query \"\"); COMP_CWORD=2; "
            "_shapedb"),
        "stats\nfiles\n");
    const std::string fish =
        outputOf("fish", "shapedb completion fish | source; complete -C \"shapedb admin st\"");
    if (!fish.empty()) {
        EXPECT_TRUE(contains(fish, "stats"));
    }
    const std::string zsh = outputOf("zsh", "source " + write("press.zsh", kPressTab));
    if (!zsh.empty()) {
        EXPECT_TRUE(contains(zsh, "ts ")) << "the rest of shapedb admin stats";
        EXPECT_TRUE(contains(zsh, "default  paper")) << "what needs no words has none";
    }
    EXPECT_EQ(runCommand({"completion", "tcsh"}).exitCode, 2);
}

TEST_F(Help, ManualPagesCoverAllCommands) {
    EXPECT_EQ(runCommand({"man", "--out", path("man")}).exitCode, 0);
    for (const char* page :
         {"shapedb.1", "shapedb-query.1", "shapedb-admin-key-create.1", "shapedb-duplicates.1"}) {
        EXPECT_TRUE(fs::exists(path("man") + "/" + page)) << page;
    }
    EXPECT_FALSE(fs::exists(path("man") + "/shapedb-__complete.1"));
    const std::string page = runCommand({"man", "query"}).out;
    EXPECT_TRUE(contains(page, ".TH SHAPEDB\\-QUERY 1"));
    EXPECT_TRUE(contains(page, "\\fB\\-\\-threshold\\fR"));
    EXPECT_TRUE(contains(runCommand({"man"}).out, "SHAPEDB_SERVER"));
    for (const auto& entry : fs::directory_iterator(path("man"))) {
        std::ifstream stream(entry.path());
        const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
        for (const char* section : {".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS"}) {
            EXPECT_TRUE(contains(text, section)) << entry.path();
        }
        EXPECT_FALSE(contains(text, "\\fB\\-\\-out\\fR")) << entry.path() << ": --out is -o everywhere";
    }
    EXPECT_EQ(runCommand({"man", "quer"}).exitCode, 2);
}

}  // namespace
}  // namespace shapedb::cli
