// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_marker.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/temporary_directory.h"

namespace shapedb::ingest {
namespace {

/// Overflows the stack; the compiler cannot turn it into a loop.
int dive(int depth) {  // NOLINT(misc-no-recursion)
    volatile char room[4'096];
    room[0] = static_cast<char>(depth);
    return depth < 0 ? 0 : dive(depth + 1) + room[0];
}

class Marker : public ::testing::Test {
  protected:
    /// What the next process reads after one that did `what` while it had scan 7 of version 3 in hand.
    std::vector<store::Crash> after(const std::function<void()>& what) {
        const pid_t child = ::fork();
        if (child == 0) {
            // No core files, and no reports of sanitizers.
            if (!installCrashMarker(path)) ::_exit(1);
            const InHand inHand(7, 3);
            what();
            ::_exit(0);
        }
        int status = 0;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        ended = status;
        return readInChild();
    }

    /// In a process of its own, so that this one keeps its signal handlers.
    std::vector<store::Crash> readInChild() {
        const std::string answer = directory.file("answer");
        const pid_t child = ::fork();
        if (child == 0) {
            const auto crashes = installCrashMarker(path);
            if (!crashes) ::_exit(1);
            std::ofstream file(answer);
            for (const store::Crash& crash : *crashes)
                file << crash.shapeId << ' ' << crash.pointsVersion << '\n';
            file.close();
            ::_exit(0);
        }
        int status = 0;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        EXPECT_EQ(status, 0);
        std::vector<store::Crash> crashes;
        std::ifstream file(answer);
        store::Crash crash;
        while (file >> crash.shapeId >> crash.pointsVersion) crashes.push_back(crash);
        return crashes;
    }

    testing::TemporaryDirectory directory;
    std::string path = directory.file("crash.marker");
    int ended = 0;
};

TEST_F(Marker, NamesTheScanOfTheCrashingThread) {
    const std::vector<std::function<void()>> crashes = {
        [] { std::abort(); },
        [] {
            volatile int* nowhere = nullptr;
            *nowhere = 1;  // NOLINT(clang-analyzer-core.NullDereference)
        },
        [] { ::raise(SIGFPE); },
    };
    for (const auto& crash : crashes) {
        const auto found = after(crash);
        EXPECT_TRUE(WIFSIGNALED(ended)) << "the handler ends the process as before";
        ASSERT_EQ(found.size(), 1u);
        EXPECT_EQ(found[0].shapeId, 7);
        EXPECT_EQ(found[0].pointsVersion, 3);
        EXPECT_TRUE(readInChild().empty()) << "told once";
    }
}

TEST_F(Marker, ToldEvenWhenTheStackIsFull) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer has a signal stack of its own";
#endif
    EXPECT_EQ(after([] { dive(0); }).size(), 1u);
}

TEST_F(Marker, KillsAndOtherProcessesBlameNobody) {
    EXPECT_TRUE(after([] { ::raise(SIGKILL); }).empty());
    const pid_t parent = ::getpid();
    EXPECT_TRUE(after([&] {
                    // From another process: a grandchild.
                    if (::fork() == 0) {
                        ::kill(::getppid(), SIGSEGV);
                        ::_exit(0);
                    }
                    for (;;) ::pause();
                }).empty());
    EXPECT_TRUE(WIFSIGNALED(ended));
    EXPECT_EQ(::getpid(), parent);
}

TEST_F(Marker, ScansPutDownBeforeAreNotBlamed) {
    EXPECT_TRUE(after([] {
                    { const InHand other(9, 9); }
                    std::abort();
                }).empty());
}

TEST_F(Marker, IsPrivateAndFollowsNoLink) {
    EXPECT_TRUE(readInChild().empty());
    EXPECT_EQ(std::filesystem::status(path).permissions(),
              std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::ofstream(directory.file("precious")) << "precious";
    std::filesystem::create_symlink(directory.file("precious"), directory.file("link"));
    EXPECT_FALSE(installCrashMarker(directory.file("link")));
    EXPECT_EQ(std::filesystem::file_size(directory.file("precious")), 8u);
    EXPECT_FALSE(installCrashMarker("/proc/none/at/all"));
}

TEST_F(Marker, DamageIsNotTrusted) {
    std::ofstream(path) << "7 3\nnonsense 1\n8 1\n";
    EXPECT_EQ(readInChild().size(), 1u);
}

}  // namespace
}  // namespace shapedb::ingest
