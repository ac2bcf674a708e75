// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/listener.h"

#include <atomic>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "server/net/connections.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::net {
namespace {

using testing::eventually;

/// A socket that is closed with this.
class Socket {
  public:
    explicit Socket(int descriptor) : descriptor_(descriptor) {}
    ~Socket() { close(); }
    Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Socket& operator=(Socket&&) = delete;
    void close() {
        if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    }
    int get() const { return descriptor_; }
    /// Whether the other side has closed it; waits for up to five seconds.
    bool wasClosed() const {
        pollfd waiting{descriptor_, POLLIN, 0};
        char byte = 0;
        return ::poll(&waiting, 1, 5'000) == 1 && ::recv(descriptor_, &byte, 1, 0) <= 0;
    }

  private:
    int descriptor_;
};

Socket connectTo(int port) {
    Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    EXPECT_EQ(::connect(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return socket;
}

class ListenerTest : public ::testing::Test {
  protected:
    void start(std::size_t maxConnections) {
        ASSERT_TRUE(listener.open({"127.0.0.1", 0}));
        ASSERT_GT(listener.endpoint().port, 0);
        ListenerEvents events;
        events.onConnection = [this](int socket) {
            const std::lock_guard<std::mutex> lock(mutex);
            served.emplace_back(socket);
        };
        events.onProblem = [this](const std::string& problem) {
            const std::lock_guard<std::mutex> lock(mutex);
            problems.push_back(problem);
        };
        events.onTooMany = [this](std::size_t) { ++tooMany; };
        listener.start(maxConnections, std::move(events));
    }
    std::size_t servedCount() {
        const std::lock_guard<std::mutex> lock(mutex);
        return served.size();
    }
    std::vector<std::string> problemsSoFar() {
        const std::lock_guard<std::mutex> lock(mutex);
        return problems;
    }
    Socket connect() const { return connectTo(listener.endpoint().port); }

    std::mutex mutex;
    std::vector<Socket> served;
    std::vector<std::string> problems;
    std::atomic<int> tooMany{0};
    Listener listener;
};

TEST_F(ListenerTest, HandsConnectionsOver) {
    start(10);
    const Socket client = connect();
    ASSERT_TRUE(eventually([&] { return servedCount() == 1; }));
    ASSERT_EQ(::send(client.get(), "x", 1, 0), 1);
    char byte = 0;
    ASSERT_TRUE(eventually([&] { return ::recv(served[0].get(), &byte, 1, 0) == 1; }));
    EXPECT_EQ(byte, 'x');
}

class UnixListenerTest : public ListenerTest {
  protected:
    sockaddr_un address() const {
        sockaddr_un unixAddress{};
        unixAddress.sun_family = AF_UNIX;
        path.copy(unixAddress.sun_path, sizeof unixAddress.sun_path - 1);
        return unixAddress;
    }
    testing::TemporaryDirectory directory;
    std::string path = directory.path() + "/s.sock";
};

TEST_F(UnixListenerTest, OnlyItsOwnerCanConnect) {
    const auto previous = ::umask(0);
    ASSERT_TRUE(listener.openUnix(path));
    ::umask(previous);
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0700u);
    std::atomic<int> accepted{0};
    ListenerEvents events;
    events.onConnection = [&](int socket) {
        ++accepted;
        ::close(socket);
    };
    listener.start(10, std::move(events));
    const Socket client(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const sockaddr_un at = address();
    ASSERT_EQ(::connect(client.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    EXPECT_TRUE(eventually([&] { return accepted == 1; }));
    listener.stop();
}

TEST_F(UnixListenerTest, ReplacesASocketThatNobodyListensAt) {
    {
        const Socket dead(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
        const sockaddr_un at = address();
        ASSERT_EQ(::bind(dead.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    }
    EXPECT_TRUE(listener.openUnix(path));
}

TEST_F(UnixListenerTest, LeavesALiveOneAndOtherFilesAlone) {
    Listener first;
    ASSERT_TRUE(first.openUnix(path));
    EXPECT_EQ(listener.openUnix(path).error().code, ErrorCode::kUnavailable);
    const std::string file = directory.path() + "/file";
    std::ofstream(file) << "precious";
    EXPECT_EQ(Listener().openUnix(file).error().code, ErrorCode::kUnavailable);
    std::string content;
    std::getline(std::ifstream(file) >> std::ws, content);
    EXPECT_EQ(content, "precious");
    EXPECT_EQ(Listener().openUnix(directory.path() + "/" + std::string(200, 'x')).error().code,
              ErrorCode::kUnavailable);
    EXPECT_EQ(Listener().openUnix("/nowhere/s.sock").error().code, ErrorCode::kUnavailable);
}

TEST_F(UnixListenerTest, IsGoneAfterwards) {
    { EXPECT_TRUE(Listener().openUnix(path)); }
    EXPECT_NE(::access(path.c_str(), F_OK), 0);
}

TEST_F(ListenerTest, RefusesMoreThanItsCapacityUntilSomeClose) {
    start(2);
    const Socket first = connect();
    const Socket second = connect();
    ASSERT_TRUE(eventually([&] { return servedCount() == 2; }));
    const Socket third = connect();
    EXPECT_TRUE(third.wasClosed());
    const Socket fourth = connect();
    EXPECT_TRUE(fourth.wasClosed());
    EXPECT_EQ(listener.refused(), 2u);
    EXPECT_EQ(tooMany, 1) << "told once for a series";

    served[0].close();
    const Socket fifth = connect();
    ASSERT_TRUE(eventually([&] { return servedCount() == 3; }));
    EXPECT_EQ(listener.connections(), 2u);
}

TEST_F(ListenerTest, RecoversWhenThereWereNoDescriptors) {
    start(10'000);
    const Socket before = connect();
    ASSERT_TRUE(eventually([&] { return servedCount() == 1; }));
    // The client's descriptors are taken before the limit is reached.
    std::vector<Socket> clients;
    for (int i = 0; i < 3; ++i) clients.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    rlimit limit{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
    rlimit few = limit;
    few.rlim_cur = 256;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
    std::vector<Socket> taken;
    for (int d = ::dup(0); d >= 0; d = ::dup(0)) taken.emplace_back(d);

    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(listener.endpoint().port));
    ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    for (const Socket& client : clients) {
        EXPECT_EQ(::connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        EXPECT_TRUE(client.wasClosed()) << "left waiting for an answer";
    }
    EXPECT_TRUE(eventually([&] { return problemsSoFar().size() == 1; }));

    taken.clear();
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
    const Socket after = connect();
    EXPECT_TRUE(eventually([&] { return servedCount() == 2; }));
    EXPECT_TRUE(eventually([&] { return problemsSoFar().size() == 2; }));
    EXPECT_EQ(problemsSoFar()[1], "");
}

TEST_F(ListenerTest, SecondOnTheSamePortIsRefused) {
    start(1);
    Listener second;
    const auto opened = second.open(listener.endpoint());
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(opened.error().message.find("in use"), std::string::npos) << opened.error().message;
}

TEST_F(ListenerTest, UnknownHostsAreRefused) {
    EXPECT_FALSE(listener.open({"no-such-host.invalid", 0}));
    EXPECT_FALSE(Listener().open({"192.0.2.1", 0})) << "not an address of this machine";
}

TEST_F(ListenerTest, StopsWithConnectionsOpen) {
    start(10);
    const Socket client = connect();
    ASSERT_TRUE(eventually([&] { return servedCount() == 1; }));
    listener.stop();
    listener.stop();
    ASSERT_EQ(::send(client.get(), "x", 1, 0), 1) << "the connection is not the listener's to close";
}

TEST(DescriptorLimit, LeavesRoomForTheDatabase) {
    EXPECT_EQ(connectionsWithin(65'536, 1'000), 1'000u);
    EXPECT_EQ(connectionsWithin(1'024, 1'000), 1'024u - kReservedDescriptors);
    EXPECT_EQ(connectionsWithin(64, 1'000), 32u);
    EXPECT_EQ(connectionsWithin(65'536, 1'000, 2), 1'000u);
    EXPECT_EQ(connectionsWithin(1'024, 1'000, 2), (1'024u - kReservedDescriptors) / 2);
}

TEST(DescriptorLimit, IsRaisedToTheHardLimit) {
    rlimit limit{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
    rlimit lower = limit;
    lower.rlim_cur = 128;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &lower), 0);
    EXPECT_EQ(raiseDescriptorLimit(), limit.rlim_max);
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
}

}  // namespace
}  // namespace shapedb::net
