// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/http_server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/strand.hpp>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/return_if_error.h"
#include "server/config/settings.h"
#include "server/http/connection.h"
#include "server/http/tls_context.h"
#include "server/net/connections.h"
#include "server/net/listener.h"
#include "server/rpc/limit_table.h"

namespace shapedb::http {
namespace {

namespace asio = boost::asio;

/// They only move bytes and write JSON; calls run in gRPC's threads.
constexpr int kThreads = 4;
/// For answers that are on their way when the server stops.
constexpr std::chrono::milliseconds kToFinishAnswers{1'000};

struct Client {
    asio::ip::tcp protocol = asio::ip::tcp::v4();
    std::string peer;  ///< as gRPC writes it
};

/// Empty if the connection has already gone.
std::optional<Client> clientOf(int socket) {
    sockaddr_storage storage{};
    socklen_t size = sizeof storage;
    if (::getpeername(socket, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return std::nullopt;
    Client client;
    asio::ip::tcp::endpoint endpoint;
    if (size > endpoint.capacity()) return std::nullopt;
    std::copy_n(reinterpret_cast<const char*>(&storage), size, reinterpret_cast<char*>(endpoint.data()));
    endpoint.resize(size);
    asio::ip::address address = endpoint.address();
    if (address.is_v6()) client.protocol = asio::ip::tcp::v6();
    if (address.is_v6() && address.to_v6().is_v4_mapped()) {
        address = asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
    }
    const std::string port = std::to_string(endpoint.port());
    client.peer = address.is_v6() ? "ipv6:%5B" + address.to_string() + "%5D:" + port
                                  : "ipv4:" + address.to_string() + ":" + port;
    return client;
}

Hosts hostsOf(const config::ServerConfig& config, const config::Endpoint& endpoint) {
    if (config::keysRequired(config)) return Hosts::any();
    std::vector<std::string> names = config::splitNames(config.http.hosts);
    names.push_back(endpoint.host);
    return Hosts::named(std::move(names));
}

}  // namespace

/// In order of construction; destroyed in reverse.
struct HttpServer::Parts {
    Parts(const config::ServerConfig& configuration, telemetry::LoggerPtr logger)
        : config(configuration), log(std::move(logger)) {}

    /// What there is once it serves.
    struct Service {
        Service(const config::ServerConfig& config, const config::Endpoint& endpoint, rpc::Inside inside,
                std::function<bool()> serving)
            : calls(std::move(inside)),
              transit(rpc::kTransportBytes, "bytes for messages on their way over HTTP"),
              connections{{methods, calls, transit},
                          hostsOf(config, endpoint),
                          embeddedFiles(),
                          std::move(serving),
                          {std::chrono::seconds(config.limits.stallSeconds), config.limits.minBytesPerSecond},
                          std::chrono::seconds(config.limits.idleSeconds)} {}

        const Methods methods;
        InnerCalls calls;
        catalog::Budget transit;
        ConnectionServices connections;
    };

    void startListening();
    void accept(int socket);
    void serve(asio::ip::tcp::socket socket, std::string peer);
    void forget(const Connection* connection);
    void runThread();
    std::vector<std::shared_ptr<Connection>> all();
    bool waitUntilNone(std::chrono::milliseconds most);

    const config::ServerConfig& config;
    const telemetry::LoggerPtr log;
    std::mutex tlsMutex;
    std::shared_ptr<asio::ssl::context> tls;  ///< null: plain

    std::optional<Service> service;
    asio::io_context context{kThreads};
    std::optional<asio::executor_work_guard<asio::io_context::executor_type>> work;
    std::vector<std::thread> threads;
    std::mutex mutex;
    std::condition_variable changed;
    std::map<const Connection*, std::weak_ptr<Connection>> open;
    std::atomic<bool> accepting{true};
    std::function<void(bool)> onAccepting;
    net::Listener listener;
};

HttpServer::HttpServer(const config::ServerConfig& config, telemetry::LoggerPtr log)
    : parts_(std::make_unique<Parts>(config, std::move(log))) {}

HttpServer::~HttpServer() { shutDown(); }

Result<void> HttpServer::useTls(const security::TlsIdentity& identity) {
    auto made = makeTlsContext(identity);
    RETURN_IF_ERROR(made);
    const std::lock_guard<std::mutex> lock(parts_->tlsMutex);
    parts_->tls = std::move(*made);
    return {};
}

Result<void> HttpServer::listen(rpc::Inside inside, std::function<bool()> serving,
                                std::function<void(bool)> onAccepting) {
    Parts& parts = *parts_;
    parts.onAccepting = std::move(onAccepting);
    if (parts.config.http.listen.empty()) return {};
    const auto wanted = config::parseEndpoint(parts.config.http.listen);
    RETURN_IF_ERROR(wanted);
    RETURN_IF_ERROR(parts.listener.open(*wanted));
    parts.service.emplace(parts.config, parts.listener.endpoint(), std::move(inside), std::move(serving));
    parts.work.emplace(parts.context.get_executor());
    for (int i = 0; i < kThreads; ++i) parts.threads.emplace_back([this] { parts_->runThread(); });
    parts.startListening();
    return {};
}

void HttpServer::Parts::runThread() {
    while (true) {
        try {
            context.run();
            return;
        } catch (const std::exception& error) {
            // Connections keep theirs to themselves; asio may run out of memory on its own.
            log->error("a step of an HTTP connection failed", {{"reason", std::string(error.what())}});
        }
    }
}

void HttpServer::Parts::startListening() {
    net::ListenerEvents events;
    events.onConnection = [this](int socket) { accept(socket); };
    events.onProblem = [this](const std::string& problem) {
        accepting = problem.empty();
        onAccepting(problem.empty());
        if (problem.empty()) return log->info("HTTP connections are accepted again");
        log->error("HTTP connections cannot be accepted", {{"reason", problem}});
    };
    events.onTooMany = [this](std::size_t count) {
        log->warn("too many HTTP connections: more are closed at once", {{"open", std::uint64_t{count}}});
    };
    const std::size_t descriptors = net::raiseDescriptorLimit();
    listener.start(
        net::connectionsWithin(descriptors, config.limits.maxConnections, config::transports(config)),
        std::move(events));
}

void HttpServer::Parts::accept(int socket) {
    bool ours = false;
    try {
        const auto client = clientOf(socket);
        boost::system::error_code error;
        asio::ip::tcp::socket wrapped(asio::make_strand(context));
        if (client) wrapped.assign(client->protocol, socket, error);
        ours = client && !error;
        if (ours) serve(std::move(wrapped), client->peer);
    } catch (const std::exception& error) {
        log->error("an HTTP connection cannot be served", {{"reason", std::string(error.what())}});
    }
    if (!ours) ::close(socket);
}

void HttpServer::Parts::serve(asio::ip::tcp::socket socket, std::string peer) {
    std::shared_ptr<asio::ssl::context> secured;
    {
        const std::lock_guard<std::mutex> lock(tlsMutex);
        secured = tls;
    }
    // The connection is known before it starts, so that nothing that it starts is overlooked at shutdown.
    auto self = std::make_shared<const Connection*>(nullptr);
    const auto connection =
        std::make_shared<Connection>(service->connections, std::move(socket), std::move(secured),
                                     std::move(peer), [this, self] { forget(*self); });
    *self = connection.get();
    {
        const std::lock_guard<std::mutex> lock(mutex);
        open.emplace(connection.get(), connection);
    }
    connection->start();
}

void HttpServer::Parts::forget(const Connection* connection) {
    const std::lock_guard<std::mutex> lock(mutex);
    open.erase(connection);
    if (open.empty()) changed.notify_all();
}

std::vector<std::shared_ptr<Connection>> HttpServer::Parts::all() {
    std::vector<std::shared_ptr<Connection>> alive;
    const std::lock_guard<std::mutex> lock(mutex);
    for (const auto& [address, weak] : open) {
        if (auto connection = weak.lock()) alive.push_back(std::move(connection));
    }
    return alive;
}

bool HttpServer::Parts::waitUntilNone(std::chrono::milliseconds most) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, most, [this] { return open.empty(); });
}

const config::Endpoint& HttpServer::endpoint() const { return parts_->listener.endpoint(); }

HttpServer::State HttpServer::state() const {
    return {parts_->listener.connections(), parts_->listener.refused(), parts_->accepting.load()};
}

void HttpServer::drain() {
    if (!parts_->service) return;
    parts_->listener.stop();
    parts_->service->connections.draining = true;
    for (const auto& connection : parts_->all()) connection->drain();
}

void HttpServer::shutDown() {
    Parts& parts = *parts_;
    if (!parts.service) return;
    drain();
    while (!parts.waitUntilNone(kToFinishAnswers)) {
        for (const auto& connection : parts.all()) connection->close();
    }
    // No connection is left to start one.
    parts.service->calls.waitUntilNone();
    parts.work.reset();
    for (std::thread& thread : parts.threads) thread.join();
    parts.threads.clear();
    parts.service.reset();
}

}  // namespace shapedb::http
