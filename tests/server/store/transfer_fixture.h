// SPDX-License-Identifier: GPL-3.0-or-later
// Fixture of the tests of export and import: a store with a collection, and a second store.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {

inline ImportRequest as(const std::string& name) {
    ImportRequest request;
    request.name = name;
    return request;
}

class TransferTest : public EachStoreTest {
  protected:
    void SetUp() override {
        EachStoreTest::SetUp();
        if (IsSkipped()) return;
        collection_ = store_->createCollection("parts", "what they are", "parameters").value();
        other_ = openOther("other.db");
    }

    /// The same database for the same name.
    std::unique_ptr<Store> openOther(const std::string& name) {
        if (engine() == Engine::kPostgres) {
            std::string& uri = others_[name];
            if (uri.empty()) uri = cluster_->createDatabase();
            return std::move(openPostgresStore(postgresOptions(uri)).value());
        }
        return openFile(name);
    }
    /// A file of either engine is a database of its own.
    std::unique_ptr<Store> openFile(const std::string& name) const {
        SqliteOptions other = options();
        other.path = folder_.file(name);
        return std::move(openSqliteStore(other).value());
    }

    /// More than one transaction takes, most of them pending, some ready and one failed.
    static constexpr int kShapes = 70, kReady = 19, kPending = 50;
    std::string exported() {
        for (int i = 0; i < kShapes; ++i) put(collection_.id, "k" + std::to_string(i), 10 + i, {{"n", "1"}});
        for (int i = 0; i < kShapes - kPending; ++i) {
            const Job job = claim();
            if (i == 7) {
                EXPECT_TRUE(store_->failJob(job, {ErrorCode::kNoInterior, "flat"}));
            } else {
                EXPECT_TRUE(store_->finishJob(job, signatureFor(job)));
            }
        }
        claim();  // running while it is exported
        const std::string path = folder_.file("parts.export");
        const auto done = store_->exportCollection(collection_.id, path, {});
        EXPECT_TRUE(done) << done.error().message;
        return path;
    }

    static void expectSoundStore(Store& store) {
        const auto problems = store.check({}).value();
        for (const std::string& problem : problems) ADD_FAILURE() << problem;
    }

    /// Nothing of a refused import is left, neither seen nor hidden.
    void expectRefused(const std::string& path, ErrorCode code, const std::string& says = {}) {
        const std::uint64_t points = other_->stats()->pointBytes;
        const auto imported = other_->importCollection(path, as("copy"), {});
        ASSERT_FALSE(imported) << path;
        EXPECT_EQ(imported.error().code, code) << imported.error().message;
        EXPECT_NE(imported.error().message.find(says), std::string::npos) << imported.error().message;
        expectNothingOf("copy");
        EXPECT_EQ(other_->stats()->pointBytes, points);
    }

    void expectNothingOf(const std::string& name) {
        EXPECT_FAILS(other_->getCollection(name), ErrorCode::kNotFound);
        EXPECT_FAILS(other_->getCollection(".import"), ErrorCode::kNotFound);
        EXPECT_FALSE(std::filesystem::exists(folder_.file("other.db.import")));
        expectSoundStore(*other_);
    }

    std::string changed(const std::string& file, const std::string& sql) {
        const std::string path = folder_.file("changed.db");
        spill(path, slurp(file));
        SqliteConnection(path, OpenMode::kReadWrite, 0).execute(sql);
        return path;
    }

    Collection collection_;
    std::map<std::string, std::string> others_;  ///< URIs of databases, by name
    std::unique_ptr<Store> other_;
};

}  // namespace shapedb::store
