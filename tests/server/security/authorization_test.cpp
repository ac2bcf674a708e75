// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/authorization.h"

#include <gtest/gtest.h>

#include "tests/server/security/memory_key_store.h"

namespace shapedb::security {
namespace {

class AuthorizationTest : public ::testing::Test {
  protected:
    AuthorizationTest() { EXPECT_TRUE(keyring_.load()); }

    std::string make(Role role, std::vector<std::string> collections = {}, KeyLimits limits = {}) {
        KeySpec spec;
        spec.name = roleName(role);
        spec.role = role;
        spec.collections = std::move(collections);
        spec.limits = limits;
        return keyring_.create(spec).value().text;
    }
    /// The error of a call that touches `collection` if it is one of collections; kInternal stands for none.
    std::string outcome(const Operation& operation, const Credentials& credentials,
                        const std::string& collection) {
        Authorization authorization(policy_, operation);
        Result<void> result = authorization.begin(credentials);
        if (result && operation.scope == Scope::kCollections)
            result = authorization.useCollection(collection);
        result = authorization.settle(result);
        return result ? "allowed" : errorCodeName(result.error().code);
    }

    KeyTable table_;
    TestClock time_;
    Keyring keyring_{std::make_unique<MemoryKeyStore>(table_), time_.clock()};
    AccessPolicy policy_{keyring_, true};
};

TEST_F(AuthorizationTest, EachOperationOfEachRoleOnEachCollection) {
    for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin}) {
        const std::string all = make(role), some = make(role, {"mine", "ours"});
        for (const Operation* operation : operations::kAll) {
            SCOPED_TRACE(std::string(roleName(role)) + " " + operation->name);
            const bool roleSuffices = static_cast<int>(role) >= static_cast<int>(operation->role);
            const std::string byRole = roleSuffices ? "allowed" : "permission_denied";
            EXPECT_EQ(outcome(*operation, {all}, "mine"), byRole);
            EXPECT_EQ(outcome(*operation, {all}, "theirs"), byRole);
            const bool whole = operation->scope == Scope::kServer || operation->scope == Scope::kKeys;
            EXPECT_EQ(outcome(*operation, {some}, "ours"), whole ? "permission_denied" : byRole);
            const bool foreign = whole || operation->scope == Scope::kCollections;
            EXPECT_EQ(outcome(*operation, {some}, "theirs"), foreign ? "permission_denied" : byRole);
        }
    }
}

TEST_F(AuthorizationTest, NobodyWithoutAKeyWhereKeysAreRequired) {
    for (const Operation* operation : operations::kAll) {
        EXPECT_EQ(outcome(*operation, {}, "mine"), "unauthenticated") << operation->name;
        EXPECT_EQ(outcome(*operation, {"nonsense"}, "mine"), "unauthenticated") << operation->name;
        EXPECT_EQ(outcome(*operation, {"", true}, "mine"), "allowed") << operation->name;
    }
}

TEST_F(AuthorizationTest, WhereNoneAreRequiredOnlyKeysStayClosed) {
    policy_.keysRequired = false;
    for (const Operation* operation : operations::kAll) {
        EXPECT_EQ(outcome(*operation, {}, "mine"),
                  operation->scope == Scope::kKeys ? "unauthenticated" : "allowed")
            << operation->name;
    }
    EXPECT_EQ(outcome(operations::kStats, {make(Role::kReader)}, ""), "permission_denied")
        << "who presents a key has its rights and no others";
    EXPECT_EQ(outcome(operations::kStats, {"nonsense"}, ""), "unauthenticated");
}

TEST_F(AuthorizationTest, AKeyPresentedAtTheUnixSocketCounts) {
    EXPECT_EQ(outcome(operations::kStats, {make(Role::kReader), true}, ""), "permission_denied");
}

TEST_F(AuthorizationTest, AHandlerThatForgetsToAskIsNotAnswered) {
    Authorization authorization(policy_, operations::kGetShape);
    ASSERT_TRUE(authorization.begin({make(Role::kReader)}));
    const auto settled = authorization.settle({});
    ASSERT_FALSE(settled);
    EXPECT_EQ(settled.error().code, ErrorCode::kInternal);
    EXPECT_EQ(authorization.settle(fail(ErrorCode::kNotFound, "x")).error().code, ErrorCode::kNotFound);
}

TEST_F(AuthorizationTest, SeesOnlyItsCollections) {
    Authorization some(policy_, operations::kListCollections);
    ASSERT_TRUE(some.begin({make(Role::kReader, {"mine"})}));
    EXPECT_TRUE(some.sees("mine"));
    EXPECT_FALSE(some.sees("mine2"));
    EXPECT_FALSE(some.sees("default"));
    Authorization all(policy_, operations::kListCollections);
    ASSERT_TRUE(all.begin({make(Role::kReader)}));
    EXPECT_TRUE(all.sees("mine2"));
}

TEST_F(AuthorizationTest, ARefusedRateTellsWhenToComeBack) {
    const std::string key = make(Role::kReader, {}, {2, 0, 0});
    for (int call = 0; call < 3; ++call) {
        Authorization authorization(policy_, operations::kServerInfo);
        const auto begun = authorization.begin({key});
        EXPECT_EQ(static_cast<bool>(begun), call < 2);
        if (call < 2) continue;
        EXPECT_EQ(begun.error().code, ErrorCode::kRateLimited);
        EXPECT_EQ(authorization.retryAfter(), std::chrono::milliseconds(500));
        EXPECT_EQ(authorization.keyName(), "reader");
    }
}

TEST_F(AuthorizationTest, ScansCountForTheKeyThatSendsThem) {
    const std::string key = make(Role::kWriter, {}, {0, 1, 0}), other = make(Role::kWriter, {}, {0, 1, 0});
    const auto send = [&](const std::string& with) {
        Authorization authorization(policy_, operations::kAddShape);
        return authorization.begin({with}) && authorization.useScan(100);
    };
    EXPECT_TRUE(send(key));
    EXPECT_FALSE(send(key));
    EXPECT_TRUE(send(other));
}

}  // namespace
}  // namespace shapedb::security
