// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/keyring.h"

#include <gtest/gtest.h>

#include "tests/server/security/memory_key_store.h"

namespace shapedb::security {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kDay = 86'400'000;

class KeyringTest : public ::testing::Test {
  protected:
    KeyringTest() { EXPECT_TRUE(keyring_.load()); }

    std::string make(Role role, KeyLimits limits = {}, std::optional<UnixMs> expires = {}) {
        KeySpec spec;
        spec.name = "test";
        spec.role = role;
        spec.limits = limits;
        spec.expires = expires;
        return keyring_.create(spec).value().text;
    }
    std::string problem(const std::string& presented) {
        const auto found = keyring_.find(presented);
        if (found) return "";
        EXPECT_EQ(found.error().code, ErrorCode::kUnauthenticated);
        return found.error().message;
    }

    KeyTable table_;
    TestClock time_;
    Keyring keyring_{std::make_unique<MemoryKeyStore>(table_), time_.clock()};
};

TEST_F(KeyringTest, FindsWhoPresentsAKey) {
    const std::string reader = make(Role::kReader), admin = make(Role::kAdmin);
    EXPECT_EQ(keyring_.find(reader).value()->key().spec.role, Role::kReader);
    EXPECT_EQ(keyring_.find(admin).value()->key().spec.role, Role::kAdmin);
}

TEST_F(KeyringTest, RefusesEverythingElse) {
    const std::string good = make(Role::kReader);
    std::string wrongSecret = good, wrongId = good;
    wrongSecret.back() = wrongSecret.back() == '0' ? '1' : '0';
    wrongId[8] = wrongId[8] == '0' ? '1' : '0';
    EXPECT_NE(problem(wrongSecret), "");
    EXPECT_EQ(problem(wrongSecret), problem(wrongId)) << "does not tell which ids exist";
    EXPECT_NE(problem("password"), "");
    EXPECT_NE(problem(""), "");
    // Neither the secret nor a part of it is in the message.
    EXPECT_EQ(problem(wrongSecret).find(wrongSecret.substr(30)), std::string::npos);
}

TEST_F(KeyringTest, KeepsNoSecret) {
    const std::string text = make(Role::kReader);
    EXPECT_EQ(table_.keys.at(0).secretSha256, hashOf(*parseApiKey(text)));
}

TEST_F(KeyringTest, KeysExpire) {
    const std::string key = make(Role::kReader, {}, time_.wall + 1'000);
    time_.pass(milliseconds(999));
    EXPECT_EQ(problem(key), "");
    EXPECT_TRUE(keyring_.highestUsableRole());
    time_.pass(milliseconds(1));
    EXPECT_EQ(problem(key), "the API key 'test' has expired");
    EXPECT_FALSE(keyring_.highestUsableRole());
}

TEST_F(KeyringTest, RevokedKeysAreUselessAtOnce) {
    const std::string key = make(Role::kReader), other = make(Role::kReader);
    const auto holder = keyring_.find(key).value();
    ASSERT_TRUE(keyring_.revoke(holder->key().id));
    EXPECT_EQ(problem(key), "the API key 'test' was revoked");
    EXPECT_TRUE(holder->revoked());
    EXPECT_EQ(problem(other), "");
    EXPECT_EQ(keyring_.revoke(holder->key().id).error().code, ErrorCode::kNotFound) << "only once";
    EXPECT_EQ(keyring_.revoke("0123456789abcdef").error().code, ErrorCode::kNotFound);
    const auto made = keyring_.create(holder->key().spec);
    ASSERT_TRUE(made);
    ASSERT_TRUE(keyring_.revoke(made->text)) << "a whole key, given by mistake";
    const auto again = keyring_.revoke(made->text);
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().message.find(made->text.substr(made->text.rfind('_') + 1)), std::string::npos);
}

TEST_F(KeyringTest, SeesWhatAnotherProcessDoes) {
    Keyring other(std::make_unique<MemoryKeyStore>(table_), time_.clock());
    ASSERT_TRUE(other.load());
    KeySpec spec;
    spec.name = "made elsewhere";
    const auto made = other.create(spec).value();
    time_.pass(milliseconds(500));
    EXPECT_EQ(problem(made.text), "");
    ASSERT_TRUE(other.revoke(made.key.id));
    time_.pass(milliseconds(500));
    EXPECT_NE(problem(made.text), "");
}

TEST_F(KeyringTest, KnownKeysGoOnWhileTheStoreCannotBeRead) {
    std::vector<std::string> problems;
    Keyring keyring(std::make_unique<MemoryKeyStore>(table_), time_.clock(), [&](const Error* problem) {
        problems.push_back(problem == nullptr ? "good" : problem->message);
    });
    ASSERT_TRUE(keyring.load());
    KeySpec spec;
    spec.name = "known";
    const auto known = keyring.create(spec).value();
    table_.fault = Error{ErrorCode::kDataLoss, "a page is damaged"};
    for (int i = 0; i < 5; ++i) {
        time_.pass(milliseconds(500));
        EXPECT_TRUE(keyring.find(known.text)) << i;
        EXPECT_EQ(keyring.find(makeApiKey()->text()).error().code, ErrorCode::kUnauthenticated)
            << "strangers learn nothing of it";
    }
    EXPECT_EQ(problems, (std::vector<std::string>{"a page is damaged"})) << "told once";
    const auto revoked = keyring.revoke(known.key.id);
    ASSERT_FALSE(revoked);
    EXPECT_EQ(revoked.error().code, ErrorCode::kDataLoss);
    EXPECT_FALSE(keyring.find(known.text)) << "refused all the same";
    table_.fault.reset();
    time_.pass(milliseconds(500));
    EXPECT_FALSE(keyring.find(known.text));
    EXPECT_EQ(problems.back(), "good");
}

TEST_F(KeyringTest, AClockThatWasYearsAheadTakesNoDaysAway) {
    const auto holder = keyring_.find(make(Role::kWriter, {0, 1, 0})).value();
    ASSERT_TRUE(holder->takeScan(1, time_.wall + 400 * kDay));
    EXPECT_TRUE(holder->takeScan(1, time_.wall));
    EXPECT_FALSE(holder->takeScan(1, time_.wall));
}

TEST_F(KeyringTest, CallsAreTakenFromABucketOfOneSecond) {
    const auto holder = keyring_.find(make(Role::kReader, {5, 0, 0})).value();
    const auto take = [&] { return holder->takeCall(time_.monotonic); };
    EXPECT_TRUE(take());  // the first call fills the bucket
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(take());
    const auto refused = take();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().error.code, ErrorCode::kRateLimited);
    EXPECT_EQ(refused.error().retryAfter, milliseconds(200));
    time_.pass(milliseconds(199));
    EXPECT_FALSE(take());
    time_.pass(milliseconds(1));
    EXPECT_TRUE(take()) << "exactly when it was told";
    EXPECT_FALSE(take());
    time_.pass(std::chrono::hours(1));
    int burst = 0;
    while (take()) ++burst;
    EXPECT_EQ(burst, 5) << "no more than a second's worth is saved up";
}

TEST_F(KeyringTest, TheHighestRoleIsThatOfKeysThatCanBeUsed) {
    EXPECT_EQ(keyring_.highestUsableRole(), std::nullopt);
    static_cast<void>(make(Role::kReader));
    EXPECT_EQ(keyring_.highestUsableRole(), Role::kReader);
    const std::string admin = make(Role::kAdmin);
    static_cast<void>(make(Role::kWriter));
    EXPECT_EQ(keyring_.highestUsableRole(), Role::kAdmin);
    ASSERT_TRUE(keyring_.revoke(admin));
    EXPECT_EQ(keyring_.highestUsableRole(), Role::kWriter);
}

TEST_F(KeyringTest, BytesThatDidNotArriveAreGivenBackWithinTheirDay) {
    time_.wall = 20'000 * kDay;
    const std::string key = make(Role::kWriter, {0, 3, 1'000});
    const auto holder = keyring_.find(key).value();
    ASSERT_TRUE(holder->takeScan(1'000, time_.wall));
    ASSERT_TRUE(keyring_.saveUsage());
    holder->giveBack(900, time_.wall);
    EXPECT_EQ(holder->usage(time_.wall).bytes, 100u);
    EXPECT_EQ(holder->usage(time_.wall).scans, 1u) << "a scan was begun";
    EXPECT_TRUE(holder->takeScan(900, time_.wall));
    ASSERT_TRUE(keyring_.saveUsage());
    const UnixMs taken = time_.wall;
    time_.wall += kDay;
    ASSERT_TRUE(holder->takeScan(500, time_.wall));
    holder->giveBack(900, taken);
    EXPECT_EQ(holder->usage(time_.wall).bytes, 500u) << "of another day";
}

TEST_F(KeyringTest, ScansAndBytesAreCountedByDay) {
    time_.wall = 20'000 * kDay + kDay - 60'000;  // a minute before midnight UTC
    const auto holder = keyring_.find(make(Role::kWriter, {0, 3, 1'000})).value();
    const auto take = [&](std::uint64_t bytes) { return holder->takeScan(bytes, time_.wall); };
    EXPECT_TRUE(take(600));
    EXPECT_FALSE(take(401)) << "more bytes than are left";
    EXPECT_EQ(holder->usage(time_.wall).bytes, 600u) << "a refused scan counts nothing";
    EXPECT_FALSE(take(~std::uint64_t{0}));
    EXPECT_TRUE(take(400));
    EXPECT_TRUE(take(0));
    const auto refused = take(0);
    ASSERT_FALSE(refused) << "the fourth scan";
    EXPECT_EQ(refused.error().retryAfter, milliseconds(60'000));
    time_.pass(milliseconds(60'000));
    EXPECT_TRUE(take(1'000)) << "a new day";
    time_.wall -= kDay;
    EXPECT_FALSE(take(1)) << "a clock that is set back gives nothing";
}

TEST_F(KeyringTest, WhatWasUsedSurvivesARestart) {
    const std::string key = make(Role::kWriter, {0, 2, 0});
    ASSERT_TRUE(keyring_.find(key).value()->takeScan(100, time_.wall));
    ASSERT_TRUE(keyring_.saveUsage());
    Keyring restarted(std::make_unique<MemoryKeyStore>(table_), time_.clock());
    ASSERT_TRUE(restarted.load());
    const auto holder = restarted.find(key).value();
    EXPECT_EQ(holder->usage(time_.wall).bytes, 100u);
    EXPECT_TRUE(holder->takeScan(1, time_.wall));
    EXPECT_FALSE(holder->takeScan(1, time_.wall));
    const auto listed = restarted.list().value();
    ASSERT_EQ(listed.size(), 1u);
    EXPECT_EQ(listed[0].today.scans, 2u);
}

TEST_F(KeyringTest, WithoutLimitsNothingIsRefused) {
    const auto holder = keyring_.find(make(Role::kReader)).value();
    for (int i = 0; i < 1'000; ++i) {
        EXPECT_TRUE(holder->takeCall(time_.monotonic));
        EXPECT_TRUE(holder->takeScan(1 << 30, time_.wall));
    }
}

}  // namespace
}  // namespace shapedb::security
