// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/sqlite_key_store.h"

#include <chrono>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "server/store/sqlite/connection.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::store {
namespace {

using security::Key;

Key keyNamed(const std::string& id, security::UnixMs created) {
    Key key;
    key.id = id;
    key.spec.name = "of " + id;
    key.spec.role = security::Role::kWriter;
    key.spec.collections = {"bones", "stones"};
    key.spec.limits = {7, 8, ~std::uint64_t{0}};
    key.secretSha256 = sha256(id.data(), id.size());
    key.created = created;
    return key;
}

class SqliteKeyStoreTest : public ::testing::Test {
  protected:
    std::unique_ptr<security::KeyStore> open() {
        auto opened = openSqliteKeyStore(path_);
        EXPECT_TRUE(opened) << opened.error().message;
        return std::move(*opened);
    }
    testing::TemporaryDirectory directory_;
    std::string path_ = directory_.path() + "/keys.sqlite";
};

TEST_F(SqliteKeyStoreTest, KeepsEverything) {
    Key first = keyNamed("b", 100), second = keyNamed("a", 200);
    second.spec.collections.clear();
    second.spec.expires = 5'000;
    {
        const auto store = open();
        ASSERT_TRUE(store->insert(second));
        ASSERT_TRUE(store->insert(first));
        ASSERT_TRUE(store->revoke("b", 300));
        ASSERT_TRUE(store->saveUsage({{"a", {20'000, 3, 4}}}));
        ASSERT_TRUE(store->saveUsage({{"a", {20'001, 1, 2}}}));
    }
    const auto store = open();
    const auto keys = store->list().value();
    ASSERT_EQ(keys.size(), 2u);
    EXPECT_EQ(keys[0].id, "b") << "the oldest first";
    EXPECT_EQ(keys[0].spec.name, "of b");
    EXPECT_EQ(keys[0].spec.role, security::Role::kWriter);
    EXPECT_EQ(keys[0].spec.collections, first.spec.collections);
    EXPECT_EQ(keys[0].spec.limits.callsPerSecond, 7u);
    EXPECT_EQ(keys[0].spec.limits.scansPerDay, 8u);
    EXPECT_EQ(keys[0].spec.limits.bytesPerDay, ~std::uint64_t{0});
    EXPECT_EQ(keys[0].secretSha256, first.secretSha256);
    EXPECT_EQ(keys[0].created, 100);
    EXPECT_EQ(keys[0].revoked, 300);
    EXPECT_FALSE(keys[0].spec.expires);
    EXPECT_TRUE(keys[1].spec.collections.empty());
    EXPECT_EQ(keys[1].spec.expires, 5'000);
    EXPECT_FALSE(keys[1].revoked);
    const auto usage = store->usage().value();
    ASSERT_EQ(usage.size(), 1u);
    EXPECT_EQ(usage.at("a").day, 20'001);
    EXPECT_EQ(usage.at("a").scans, 1u);
}

TEST_F(SqliteKeyStoreTest, RevokesOnce) {
    const auto store = open();
    ASSERT_TRUE(store->insert(keyNamed("a", 1)));
    EXPECT_EQ(store->revoke("a", 9).value().revoked, 9);
    EXPECT_EQ(store->revoke("a", 10).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(store->revoke("b", 10).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(store->list().value()[0].revoked, 9);
}

TEST_F(SqliteKeyStoreTest, TheVersionTellsOfOtherProcesses) {
    const auto ours = open(), theirs = open();
    const auto before = ours->version().value();
    EXPECT_EQ(ours->version().value(), before);
    ASSERT_TRUE(theirs->insert(keyNamed("a", 1)));
    const auto after = ours->version().value();
    EXPECT_NE(after, before);
    EXPECT_EQ(ours->list().value().size(), 1u);
    EXPECT_EQ(ours->version().value(), after);
}

TEST_F(SqliteKeyStoreTest, FollowsAFileThatIsPutInItsPlace) {
    const auto store = open();
    ASSERT_TRUE(store->insert(keyNamed("a", 1)));
    const auto before = store->version().value();
    std::filesystem::copy(path_, path_ + ".copy");
    std::filesystem::rename(path_ + ".copy", path_);
    EXPECT_NE(store->version().value(), before);
    ASSERT_TRUE(open()->revoke("a", 9)) << "by another process";
    EXPECT_EQ(store->list().value()[0].revoked, 9);
    std::filesystem::remove(path_);
    EXPECT_EQ(store->version().error().code, ErrorCode::kStorage);
    EXPECT_FALSE(store->insert(keyNamed("b", 1))) << "not into a file that nobody can open again";
}

TEST_F(SqliteKeyStoreTest, TheVersionWaitsForNobody) {
    const auto store = open();
    SqliteConnection other(path_, OpenMode::kReadWrite, 0);
    other.execute("BEGIN EXCLUSIVE");
    const auto began = std::chrono::steady_clock::now();
    EXPECT_TRUE(store->version());
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(4)) << "others wait 5 s";
    other.rollback();
}

TEST_F(SqliteKeyStoreTest, OnlyTheOwnerCanReadTheFile) {
    const auto previous = ::umask(0);
    open();
    ::umask(previous);
    struct stat status {};
    ASSERT_EQ(::stat(path_.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(SqliteKeyStoreTest, RefusesOtherFiles) {
    std::ofstream(path_) << "not a database, but long enough to look like one: " << std::string(2'000, 'x');
    const auto opened = openSqliteKeyStore(path_);
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kDataLoss);
    EXPECT_EQ(openSqliteKeyStore(directory_.path()).error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace shapedb::store
