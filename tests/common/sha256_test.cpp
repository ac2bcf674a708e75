// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/sha256.h"

#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

// FIPS 180-4 examples.
TEST(Sha256, KnownAnswers) {
    EXPECT_EQ(toHex(sha256(nullptr, 0)), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(toHex(sha256("abc", 3)), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    const std::string million(1000000, 'a');
    EXPECT_EQ(toHex(sha256(million.data(), million.size())),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesEqualTheWhole) {
    Random random(7);
    std::string data;
    for (int i = 0; i < 10000; ++i) data.push_back(static_cast<char>(random.next()));
    Sha256 hash;
    for (int round = 0; round < 20; ++round) {
        std::size_t at = 0;
        while (at < data.size()) {
            const std::size_t n = std::min<std::size_t>(random.below(700), data.size() - at);
            hash.update(data.data() + at, n);
            at += n;
        }
        EXPECT_EQ(hash.finish(), sha256(data.data(), data.size())) << "round " << round;
    }
}

TEST(Sha256, FinishStartsAfresh) {
    Sha256 hash;
    hash.update("x", 1);
    hash.finish();
    EXPECT_EQ(hash.finish(), sha256(nullptr, 0));
}

}  // namespace
}  // namespace shapedb
