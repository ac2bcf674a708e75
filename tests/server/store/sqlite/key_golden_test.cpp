// SPDX-License-Identifier: GPL-3.0-or-later
// One small file of API keys per schema version, opened and used by every later version.
// SHAPEDB_WRITE_GOLDEN_KEYS=FILE writes the one of the current schema (docs/storage.md).
#include <cstdlib>

#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/sqlite_key_store.h"
#include "tests/server/store/sqlite/golden_file.h"

namespace shapedb::store {
namespace {

using security::Key;

// Of nobody: made for this file.
const char* const kWriterKey =
    "shapedb_0123456789abcdef_00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff";
const char* const kAdminKey =
    "shapedb_fedcba9876543210_ffeeddccbbaa99887766554433221100ffeeddccbbaa99887766554433221100";

Key keyOf(const char* text, security::UnixMs created) {
    const auto parsed = security::parseApiKey(text);
    EXPECT_TRUE(parsed) << text;
    Key key;
    key.id = parsed->id;
    key.secretSha256 = security::hashOf(*parsed);
    key.created = created;
    return key;
}

std::string goldenKeys(int version) { return unpackedGolden("keys_v" + std::to_string(version)); }

class KeyGoldenTest : public ::testing::TestWithParam<int> {
  protected:
    std::unique_ptr<security::KeyStore> open() {
        auto opened = openSqliteKeyStore(path_);
        EXPECT_TRUE(opened) << opened.error().message;
        return opened ? std::move(*opened) : nullptr;
    }
    Folder folder_;
    std::string path_ = folder_.file("keys.sqlite");
};
using KeyGoldenFile = KeyGoldenTest;

INSTANTIATE_TEST_SUITE_P(Versions, KeyGoldenTest, ::testing::Values(1));

/// A limited key that was revoked, and one without limits that expires.
TEST_F(KeyGoldenFile, CanBeWritten) {
    {
        const auto store = open();
        Key writer = keyOf(kWriterKey, 1'000);
        writer.spec.name = "scanner";
        writer.spec.role = security::Role::kWriter;
        writer.spec.collections = {"bones", "stones"};
        writer.spec.limits = {7, 8, ~std::uint64_t{0}};
        Key admin = keyOf(kAdminKey, 2'000);
        admin.spec.name = "operator";
        admin.spec.role = security::Role::kAdmin;
        admin.spec.expires = 9'000'000;
        ASSERT_TRUE(store->insert(writer));
        ASSERT_TRUE(store->insert(admin));
        ASSERT_TRUE(store->revoke(writer.id, 3'000));
        ASSERT_TRUE(store->saveUsage({{writer.id, {20'000, 3, 4}}}));
    }
    const char* target = std::getenv("SHAPEDB_WRITE_GOLDEN_KEYS");
    if (target != nullptr) writeGolden(target, slurp(path_));
}

TEST_F(KeyGoldenFile, ThereIsOneForEachVersion) {
    EXPECT_FALSE(goldenKeys(static_cast<int>(embeddedKeyMigrations().size())).empty());
}

TEST_P(KeyGoldenTest, OpensAndServes) {
    const std::string bytes = goldenKeys(GetParam());
    ASSERT_FALSE(bytes.empty());
    spill(path_, bytes);
    const auto store = open();
    ASSERT_TRUE(store);
    const auto keys = store->list().value();
    ASSERT_EQ(keys.size(), 2u);
    const Key& writer = keys[0];
    EXPECT_EQ(writer.id, "0123456789abcdef");
    EXPECT_EQ(writer.secretSha256, keyOf(kWriterKey, 0).secretSha256) << "whoever has the key still gets in";
    EXPECT_EQ(writer.spec.name, "scanner");
    EXPECT_EQ(writer.spec.role, security::Role::kWriter);
    EXPECT_EQ(writer.spec.collections, (std::vector<std::string>{"bones", "stones"}));
    EXPECT_EQ(writer.spec.limits.callsPerSecond, 7u);
    EXPECT_EQ(writer.spec.limits.scansPerDay, 8u);
    EXPECT_EQ(writer.spec.limits.bytesPerDay, ~std::uint64_t{0});
    EXPECT_EQ(writer.created, 1'000);
    EXPECT_EQ(writer.revoked, 3'000);
    EXPECT_FALSE(writer.spec.expires);
    const Key& admin = keys[1];
    EXPECT_EQ(admin.secretSha256, keyOf(kAdminKey, 0).secretSha256);
    EXPECT_EQ(admin.spec.role, security::Role::kAdmin);
    EXPECT_TRUE(admin.spec.collections.empty());
    EXPECT_EQ(admin.spec.expires, 9'000'000);
    EXPECT_FALSE(admin.revoked);
    const auto usage = store->usage().value();
    ASSERT_EQ(usage.size(), 1u);
    EXPECT_EQ(usage.at(writer.id).day, 20'000);
    EXPECT_EQ(usage.at(writer.id).scans, 3u);
    EXPECT_EQ(usage.at(writer.id).bytes, 4u);

    // And goes on.
    ASSERT_TRUE(store->revoke(admin.id, 4'000));
    Key third = keyOf(kAdminKey, 5'000);
    third.id = "00000000000000ff";
    ASSERT_TRUE(store->insert(third));
    EXPECT_EQ(store->list()->size(), 3u);
}

}  // namespace
}  // namespace shapedb::store
