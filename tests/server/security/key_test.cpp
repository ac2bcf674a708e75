// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/key.h"

#include <set>

#include <gtest/gtest.h>

namespace shapedb::security {
namespace {

TEST(ApiKeys, AreDifferentAndReadBack) {
    std::set<std::string> ids, secrets;
    for (int i = 0; i < 100; ++i) {
        const auto key = makeApiKey();
        ASSERT_TRUE(key);
        EXPECT_TRUE(ids.insert(key->id).second);
        EXPECT_TRUE(secrets.insert(key->secret).second);
        const auto parsed = parseApiKey(key->text());
        ASSERT_TRUE(parsed);
        EXPECT_EQ(parsed->id, key->id);
        EXPECT_EQ(parsed->secret, key->secret);
    }
    EXPECT_EQ(ids.begin()->size(), 16u);
    EXPECT_EQ(secrets.begin()->size(), 64u) << "256 bits";
}

TEST(ApiKeys, OtherTextIsNone) {
    const std::string good = makeApiKey()->text();
    for (const std::string& bad : {std::string(), std::string("shapedb_"), good.substr(1), good + "0",
                                   good.substr(0, good.size() - 1), "SHAPEDB_" + good.substr(8),
                                   good.substr(0, good.size() - 1) + "G", std::string(good.size(), '_')}) {
        EXPECT_FALSE(parseApiKey(bad)) << bad;
    }
}

TEST(ApiKeys, AreStoredAsTheHashOfTheirSecret) {
    const ApiKey key{"0123456789abcdef", std::string(64, 'a')};
    // printf a*64 | sha256sum
    EXPECT_EQ(toHex(hashOf(key)), "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb");
    Sha256Digest other = hashOf(key);
    EXPECT_TRUE(equalInConstantTime(other, hashOf(key)));
    for (std::size_t byte : {std::size_t{0}, std::size_t{31}}) {
        Sha256Digest changed = other;
        changed[byte] ^= 1;
        EXPECT_FALSE(equalInConstantTime(changed, other));
    }
}

TEST(KeySpecs, AreChecked) {
    KeySpec good;
    good.name = "Ann's scanner";
    good.collections = {"bones", "stones.2"};
    good.expires = 2'000;
    EXPECT_TRUE(validate(good, 1'999));
    const auto refuses = [&](auto change) {
        KeySpec bad = good;
        change(bad);
        const auto checked = validate(bad, 1'999);
        return !checked && checked.error().code == ErrorCode::kInvalidArgument;
    };
    EXPECT_TRUE(refuses([](KeySpec& s) { s.name = ""; }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.name = std::string(129, 'x'); }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.name = "a\033[2J"; }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.collections = {""}; }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.collections = {"no spaces"}; }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.collections.assign(1'001, "x"); }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.expires = 1'999; }));
    EXPECT_FALSE(refuses([](KeySpec& s) { s.expires = 253'402'300'799'999; })) << "the end of the year 9999";
    EXPECT_TRUE(refuses([](KeySpec& s) { s.expires = 253'402'300'800'000; }));
    EXPECT_TRUE(refuses([](KeySpec& s) { s.expires = std::numeric_limits<UnixMs>::max(); }));
}

TEST(Roles, HaveNames) {
    for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin}) {
        EXPECT_EQ(roleFromName(roleName(role)).value(), role);
    }
    EXPECT_FALSE(roleFromName("root"));
}

}  // namespace
}  // namespace shapedb::security
