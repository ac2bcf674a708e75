// SPDX-License-Identifier: GPL-3.0-or-later
// Servers on one PostgreSQL database, each with a part of the signatures, and searches that go on meanwhile.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/integration/support/client.h"
#include "tests/integration/support/server_process.h"
#include "tests/server/support/postgres_cluster.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::testing {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

inline constexpr const char* kThings = "things";
inline constexpr std::chrono::milliseconds kLease{1'000};

class ClusterTest : public ::testing::Test {
  protected:
    void SetUp() override {
        SHAPEDB_USE_POSTGRES(postgres_);
        uri_ = postgres_->createDatabase();
    }

    void start(int replicas, const std::vector<std::string>& names = {"one", "two", "three"}) {
        replicas_ = replicas;
        for (const std::string& name : names) startServer(name);
        ASSERT_TRUE(eventually([&] { return everySearchIsAnswered(); })) << "shards without a server";
    }

    void startServer(const std::string& name, const std::vector<std::string>& more = {}) {
        std::vector<std::string> flags = {"--store-engine",
                                          "postgres",
                                          "--postgres-uri",
                                          uri_,
                                          "--postgres-server-name",
                                          name,
                                          "--postgres-job-lease-seconds",
                                          "2",
                                          "--cluster-replicas",
                                          std::to_string(replicas_),
                                          "--cluster-lease-milliseconds",
                                          std::to_string(kLease.count())};
        flags.insert(flags.end(), more.begin(), more.end());
        servers_[name] = std::make_unique<ServerProcess>(folder_.file(name), flags);
        clients_[name] = std::make_unique<Client>(servers_[name]->address());
    }

    bool everySearchIsAnswered() {
        for (const auto& [name, client] : clients_) {
            grpc::health::v1::HealthCheckRequest request;
            request.set_service("shapedb.v1.SearchService");
            const auto reply = unary(*client->health, &grpc::health::v1::Health::Stub::Check, request);
            if (reply.value.status() != grpc::health::v1::HealthCheckResponse::SERVING) return false;
        }
        return true;
    }

    Client& any(Random& random) {
        auto chosen = clients_.begin();
        std::advance(chosen, static_cast<std::ptrdiff_t>(random.below(clients_.size())));
        return *chosen->second;
    }
    Client& client(const std::string& name) { return *clients_.at(name); }

    static Reply<pb::SearchResponse> searchByKey(Client& client, const std::string& key,
                                                 const pb::SearchOptions& options,
                                                 std::chrono::milliseconds timeout = 60s) {
        pb::SearchByKeyRequest request;
        *request.mutable_options() = options;
        request.set_key(key);
        request.set_include_self(true);
        return unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request, timeout);
    }

    /// Whether the server has heard of the collection, soon.
    static bool knows(Client& client) {
        pb::GetCollectionRequest request;
        request.set_name(kThings);
        return eventually([&] {
            return unary(*client.collections, &pb::CollectionService::Stub::GetCollection, request).ok();
        });
    }

    /// Stores `count` scans by the first server.
    void fill(int count) {
        Client& first = *clients_.begin()->second;
        ASSERT_TRUE(createCollection(first, kThings, pb::PROFILE_DEFAULT).ok());
        for (int i = 0; i < count; ++i) {
            const auto added = addAndWait(first, kThings, "k" + std::to_string(i),
                                          familyScan("mug", static_cast<std::size_t>(i), 1, 800));
            ASSERT_TRUE(added.ok()) << added;
        }
        for (const auto& [name, one] : clients_) ASSERT_TRUE(knows(*one)) << name;
    }

    /// Searches again and again by these servers until it is destroyed.
    class Load {
      public:
        Load(ClusterTest& test, std::vector<std::string> names) {
            for (const std::string& name : names) {
                threads_.emplace_back([this, &client = test.client(name)] {
                    while (!over_) {
                        const auto found = searchByKey(client, "k1", searchOptions(kThings, 20), 20s);
                        const auto now = Clock::now();
                        if (found.ok() && found.value.hits_size() > 0) {
                            ++answered;
                            continue;
                        }
                        ++failed;
                        const std::lock_guard<std::mutex> lock(mutex_);
                        lastFailure_ = now;
                        what_ = found.status.error_message();
                        std::this_thread::sleep_for(20ms);
                    }
                });
            }
        }
        ~Load() {
            over_ = true;
            for (std::thread& thread : threads_) thread.join();
        }
        Clock::time_point lastFailure() const {
            const std::lock_guard<std::mutex> lock(mutex_);
            return lastFailure_;
        }
        std::string what() const {
            const std::lock_guard<std::mutex> lock(mutex_);
            return what_;
        }
        std::atomic<int> answered{0};
        std::atomic<int> failed{0};

      private:
        std::atomic<bool> over_{false};
        mutable std::mutex mutex_;
        Clock::time_point lastFailure_{};
        std::string what_;
        std::vector<std::thread> threads_;
    };

    TemporaryDirectory folder_;
    PostgresCluster* postgres_ = nullptr;
    std::string uri_;
    int replicas_ = 1;
    std::map<std::string, std::unique_ptr<ServerProcess>> servers_;
    std::map<std::string, std::unique_ptr<Client>> clients_;
};

}  // namespace shapedb::testing
