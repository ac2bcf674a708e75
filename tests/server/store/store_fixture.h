// SPDX-License-Identifier: GPL-3.0-or-later
// Fixtures of the store tests: a private folder with a database, small clouds.
#pragma once

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/sha256.h"
#include "core/base/random.h"
#include "server/store/postgres/connection.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/server/support/postgres_cluster.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::store {

inline std::vector<float> cloud(std::uint64_t seed, std::size_t points = 8) {
    Random random(seed);
    std::vector<float> xyz(3 * points);
    for (float& value : xyz) value = static_cast<float>(random.uniform(-1.0, 1.0));
    return xyz;
}

inline Checksum checksumOf(const std::vector<float>& points) {
    return sha256(points.data(), points.size() * sizeof(float));
}

inline PutRequest request(std::int64_t collectionId, const std::string& key, const std::vector<float>& points,
                          Metadata metadata = {}, const Point3& origin = {}) {
    PutRequest put(VerifiedScan::verify(points, origin).value());
    put.collectionId = collectionId;
    put.key = key;
    put.metadata = replacedBy(std::move(metadata));
    return put;
}

/// Names what it was made of, so that a mix-up shows.
inline SignatureRow signatureFor(std::int64_t shapeId, std::int64_t pointsVersion, std::int64_t generation) {
    return {shapeId,
            pointsVersion,
            generation,
            "signature of " + std::to_string(shapeId) + "/" + std::to_string(pointsVersion) + "/" +
                std::to_string(generation),
            "surface of " + std::to_string(shapeId) + "/" + std::to_string(pointsVersion),
            "views of " + std::to_string(shapeId) + "/" + std::to_string(pointsVersion)};
}
inline SignatureRow signatureFor(const Job& job) {
    return signatureFor(job.shapeId, job.pointsVersion, job.generation);
}

inline bool operator==(const Shape& a, const Shape& b) {
    const auto failureOf = [](const Shape& shape) {
        return shape.failure ? std::string(errorCodeName(shape.failure->code)) + shape.failure->message : "";
    };
    return a.id == b.id && a.collectionId == b.collectionId && a.key == b.key && a.version == b.version &&
           a.pointsVersion == b.pointsVersion && a.state == b.state && a.pointCount == b.pointCount &&
           a.checksum == b.checksum && a.origin == b.origin && a.metadata == b.metadata &&
           failureOf(a) == failureOf(b);
}

inline std::string slurp(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}
inline void spill(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

using Folder = testing::TemporaryDirectory;

/// The databases that a store may be on.
enum class Engine { kSqlite, kPostgres };
inline std::string engineName(Engine engine) { return engine == Engine::kSqlite ? "Sqlite" : "Postgres"; }

/// On SQLite.
class StoreTest : public ::testing::Test {
  protected:
    virtual Engine engine() const { return Engine::kSqlite; }

    void SetUp() override {
        if (engine() == Engine::kPostgres) {
            SHAPEDB_USE_POSTGRES(cluster_);
            database_ = cluster_->createDatabase();
        }
        open();
    }
    void open() {
        store_.reset();
        auto opened = engine() == Engine::kSqlite ? openSqliteStore(options())
                                                  : openPostgresStore(postgresOptions(database_));
        ASSERT_TRUE(opened) << opened.error().message;
        store_ = std::move(*opened);
    }

    SqliteOptions options() const {
        SqliteOptions options;
        options.path = folder_.file("shapes.db");
        options.readers = 2;
        options.now = [this] { return ++*clock_; };
        return options;
    }
    PostgresOptions postgresOptions(const std::string& uri) const {
        PostgresOptions options;
        options.uri = uri;
        options.serverName = "test";
        options.connections = 4;
        options.lockPath = folder_.file(uri.substr(uri.rfind('=') + 1));
        options.temporaryFolder = folder_.file("");
        options.now = [this] { return ++*clock_; };
        return options;
    }
    /// Changes rows as no store would. Nobody may have the database open.
    void execute(const std::string& sql) {
        if (engine() == Engine::kSqlite) {
            SqliteConnection(options().path, OpenMode::kReadWrite, 1'000).execute(sql);
        } else {
            PostgresConnection({database_, {}, std::chrono::seconds(60), "test"}, {}).execute(sql);
        }
    }

    Collection collection(const std::string& name = "parts") {
        return store_->createCollection(name, "", "parameters of " + name).value();
    }
    Shape put(std::int64_t collectionId, const std::string& key, std::uint64_t seed, Metadata metadata = {}) {
        const auto points = cloud(seed);
        auto result = store_->putShape(request(collectionId, key, points, std::move(metadata)));
        EXPECT_TRUE(result) << result.error().message;
        return result ? result->shape : Shape{};
    }
    Job claim() {
        auto job = store_->claimJob();
        EXPECT_TRUE(job && *job);
        return job && *job ? **job : Job{};
    }
    /// Finishes all queued jobs with a signature.
    void finishAll() {
        while (true) {
            auto job = store_->claimJob();
            ASSERT_TRUE(job) << job.error().message;
            if (!*job) return;
            auto done = store_->finishJob(**job, signatureFor(**job));
            ASSERT_TRUE(done) << done.error().message;
        }
    }
    void expectSound() {
        const auto problems = store_->check({});
        ASSERT_TRUE(problems) << problems.error().message;
        for (const auto& problem : *problems) ADD_FAILURE() << problem;
    }

    Folder folder_;
    std::unique_ptr<std::atomic<TimestampMs>> clock_ = std::make_unique<std::atomic<TimestampMs>>(1000);
    shapedb::testing::PostgresCluster* cluster_ = nullptr;
    std::string database_;  ///< its URI
    std::unique_ptr<Store> store_;
};

/// On each engine. A suite of such tests is followed by SHAPEDB_ON_EACH_ENGINE(Suite).
class EachStoreTest : public StoreTest, public ::testing::WithParamInterface<Engine> {
  protected:
    Engine engine() const override { return GetParam(); }
};
#define SHAPEDB_ON_EACH_ENGINE(suite)                                                          \
    INSTANTIATE_TEST_SUITE_P(On, suite, ::testing::Values(Engine::kSqlite, Engine::kPostgres), \
                             [](const auto& each) { return engineName(each.param); })

#define EXPECT_FAILS(expression, expectedCode)                                         \
    do {                                                                               \
        const auto failed_ = (expression);                                             \
        ASSERT_FALSE(failed_) << "no error";                                           \
        EXPECT_EQ(failed_.error().code, expectedCode)                                  \
            << errorCodeName(failed_.error().code) << ": " << failed_.error().message; \
    } while (false)

}  // namespace shapedb::store
