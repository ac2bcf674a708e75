// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/listener.h"

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

namespace shapedb::net {

namespace {

constexpr int kBacklog = 1'024;
/// How often connections that were closed are noticed.
constexpr int kLookMs = 1'000;
/// Between two attempts while connections cannot be accepted.
constexpr int kRetryMs = 50;

using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

std::string reason(int number) { return std::generic_category().message(number); }

tl::unexpected<Error> cannotListen(const std::string& where, const std::string& why) {
    return fail(ErrorCode::kUnavailable, "cannot listen on " + where + ": " + why);
}

Result<Addresses> resolve(const config::Endpoint& endpoint) {
    addrinfo hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
    addrinfo* found = nullptr;
    const int code =
        ::getaddrinfo(endpoint.host.c_str(), std::to_string(endpoint.port).c_str(), &hints, &found);
    if (code != 0) return cannotListen(endpoint.text(), ::gai_strerror(code));
    return Addresses(found, ::freeaddrinfo);
}

/// A bound and listening socket, or -1 with errno.
int listenOn(const addrinfo& address) {
    const int socket =
        ::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol);
    if (socket < 0) return -1;
    const int on = 1;
    const int off = 0;
    // No SO_REUSEPORT: with it two servers on one port would each get half of the calls.
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (address.ai_family == AF_INET6) ::setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
    if (::bind(socket, address.ai_addr, address.ai_addrlen) == 0 && ::listen(socket, kBacklog) == 0) {
        return socket;
    }
    const int why = errno;
    ::close(socket);
    errno = why;
    return -1;
}

int portOf(int socket) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
    const auto port = address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(&address)->sin6_port
                                                    : reinterpret_cast<sockaddr_in*>(&address)->sin_port;
    return ntohs(port);
}

bool isLoopback(const sockaddr& address) {
    if (address.sa_family == AF_INET6) {
        return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
    }
    return (ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24) == 127;
}

void setPort(addrinfo& address, int port) {
    const auto wire = htons(static_cast<std::uint16_t>(port));
    if (address.ai_family == AF_INET6) {
        reinterpret_cast<sockaddr_in6*>(address.ai_addr)->sin6_port = wire;
    } else {
        reinterpret_cast<sockaddr_in*>(address.ai_addr)->sin_port = wire;
    }
}

Result<sockaddr_un> unixAddress(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    // The last byte stays zero.
    if (path.size() >= sizeof address.sun_path) {
        return cannotListen(path, "the path of a Unix socket has at most " +
                                      std::to_string(sizeof address.sun_path - 1) + " bytes");
    }
    std::copy(path.begin(), path.end(), address.sun_path);
    return address;
}

/// Removes the socket of a process that is gone; leaves alone whatever else has the name.
Result<void> removeAbandoned(const std::string& path, const sockaddr_un& address) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0) return {};
    if (!S_ISSOCK(status.st_mode)) return cannotListen(path, "there is a file of that name");
    const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (probe < 0) return cannotListen(path, reason(errno));
    const bool alive = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const int why = errno;
    ::close(probe);
    if (alive) return cannotListen(path, "another process listens there");
    if (why != ECONNREFUSED) return cannotListen(path, reason(why));
    ::unlink(path.c_str());
    return {};
}

int acceptOne(int listening) { return ::accept4(listening, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC); }

int openSpare() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

/// The connection had gone before it was accepted, or the network failed on its way: not our trouble.
bool concernsOneConnection(int number) {
    switch (number) {
        case ECONNABORTED:
        case EINTR:
        case EPROTO:
        case ENETDOWN:
        case ENOPROTOOPT:
        case EHOSTDOWN:
        case ENONET:
        case EHOSTUNREACH:
        case EOPNOTSUPP:
        case ENETUNREACH:
        case EPERM: return true;
        default: return false;
    }
}

}  // namespace

Listener::~Listener() {
    stop();
    for (const int socket : listening_) ::close(socket);
    struct stat status {};
    // Not what somebody else has put there since.
    const bool ours = !unixPath_.empty() && ::lstat(unixPath_.c_str(), &status) == 0 &&
                      status.st_ino == unixInode_ && status.st_dev == unixDevice_;
    if (ours) ::unlink(unixPath_.c_str());
    if (wake_ >= 0) ::close(wake_);
    if (spare_ >= 0) ::close(spare_);
}

Result<void> Listener::open(const config::Endpoint& endpoint) {
    endpoint_ = endpoint;
    const auto addresses = resolve(endpoint);
    RETURN_IF_ERROR(addresses);
    int why = 0;
    for (addrinfo* at = addresses->get(); at != nullptr; at = at->ai_next) {
        if (endpoint.isLoopback() && !isLoopback(*at->ai_addr)) {
            return cannotListen(endpoint.text(), "the name leads beyond this machine");
        }
        if (endpoint_.port != 0) setPort(*at, endpoint_.port);  // all on the one that was picked
        const int socket = listenOn(*at);
        if (socket < 0) {
            why = errno;
            // A machine without IPv6 still has "localhost" in both families; an address in use is a mistake.
            if (why == EADDRINUSE) break;
            continue;
        }
        listening_.push_back(socket);
        if (endpoint_.port == 0) endpoint_.port = portOf(socket);
    }
    if (listening_.empty() || why == EADDRINUSE) return cannotListen(endpoint.text(), reason(why));
    return makeEvents(endpoint_.text());
}

Result<void> Listener::openUnix(const std::string& path) {
    const auto address = unixAddress(path);
    RETURN_IF_ERROR(address);
    RETURN_IF_ERROR(removeAbandoned(path, *address));
    const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket < 0) return cannotListen(path, reason(errno));
    // Before it has a name, so that nobody else can connect at any time.
    const bool bound = ::fchmod(socket, S_IRWXU) == 0 &&
                       ::bind(socket, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0;
    struct stat status {};
    if (bound && ::lstat(path.c_str(), &status) == 0) {
        unixPath_ = path;
        unixInode_ = status.st_ino;
        unixDevice_ = status.st_dev;
    }
    if (!bound || ::listen(socket, kBacklog) != 0) {
        const int why = errno;
        ::close(socket);
        return cannotListen(path, reason(why));
    }
    listening_.push_back(socket);
    return makeEvents(path);
}

Result<void> Listener::makeEvents(const std::string& where) {
    wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    spare_ = openSpare();
    if (wake_ < 0 || spare_ < 0) return cannotListen(where, reason(errno));
    return {};
}

void Listener::start(std::size_t maxConnections, ListenerEvents events) {
    maxConnections_ = maxConnections;
    events_ = std::move(events);
    thread_ = std::thread([this] { run(); });
}

void Listener::stop() {
    if (!thread_.joinable()) return;
    const std::uint64_t one = 1;
    // An eventfd with room takes a write; this is its only one.
    static_cast<void>(::write(wake_, &one, sizeof one) == sizeof one);
    thread_.join();
}

void Listener::run() {
    std::vector<pollfd> waiting = {{wake_, POLLIN, 0}};
    for (const int socket : listening_) waiting.push_back({socket, POLLIN, 0});
    while (true) {
        const int ready = ::poll(waiting.data(), waiting.size(), inTrouble_ ? kRetryMs : kLookMs);
        if ((waiting[0].revents & POLLIN) != 0) return;
        connections_ = open_.count();
        if (connections_ < maxConnections_) overCapacity_ = false;
        if (ready <= 0 && !inTrouble_) continue;
        bool good = true;
        for (std::size_t i = 1; good && i < waiting.size(); ++i) good = acceptAll(waiting[i].fd);
        if (good) {
            reportProblem("");
            continue;
        }
        reportProblem(reason(errno));
        // What waits stays ready: without a pause this would spin.
        ::poll(waiting.data(), 1, kRetryMs);
    }
}

bool Listener::acceptAll(int listening) {
    while (true) {
        const int socket = acceptOne(listening);
        if (socket >= 0) {
            handOver(socket);
            continue;
        }
        if (errno == EAGAIN || errno == EWOULDBLOCK) return true;
        if (concernsOneConnection(errno)) continue;
        const int why = errno;
        if ((why == EMFILE || why == ENFILE) && spare_ >= 0) {
            // Closes one connection that waits, so that its client tries elsewhere or later.
            ::close(spare_);
            const int unwanted = acceptOne(listening);
            if (unwanted >= 0) {
                ++refused_;
                ::close(unwanted);
            }
            spare_ = openSpare();
        } else if (spare_ < 0) {
            spare_ = openSpare();
        }
        errno = why;
        return false;
    }
}

void Listener::handOver(int socket) {
    if (connections_ >= maxConnections_) connections_ = open_.count();
    if (connections_ >= maxConnections_) {
        ++refused_;
        if (!std::exchange(overCapacity_, true)) events_.onTooMany(connections_);
        ::close(socket);
        return;
    }
    const int on = 1;
    // Of no effect on a Unix socket.
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    open_.add(socket);
    ++connections_;
    events_.onConnection(socket);
}

void Listener::reportProblem(const std::string& problem) {
    const bool trouble = !problem.empty();
    if (std::exchange(inTrouble_, trouble) != trouble) events_.onProblem(problem);
}

}  // namespace shapedb::net
