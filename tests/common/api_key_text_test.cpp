// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/api_key_text.h"

#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

const std::string kPublic = "shapedb_0123456789abcdef_";
const std::string kSecret(kApiKeySecretDigits, 'a');

TEST(MaskSecrets, LeavesTheIdOfEachKey) {
    EXPECT_EQ(maskSecrets(kPublic + kSecret), kPublic + "***");
    EXPECT_EQ(maskSecrets("key 'x/" + kPublic + kSecret + "' and " + kPublic + kSecret + "."),
              "key 'x/" + kPublic + "***' and " + kPublic + "***.");
    EXPECT_EQ(maskSecrets("shapedb_" + kPublic + kSecret), "shapedb_" + kPublic + "***");
    EXPECT_EQ(maskSecrets("SHAPEDB_0123456789ABCDEF_AB"), "SHAPEDB_0123456789ABCDEF_***");
}

TEST(MaskSecrets, AlsoWhereOnlyAPartOfItIsLeft) {
    for (std::size_t digits = 1; digits <= kSecret.size(); ++digits) {
        EXPECT_EQ(maskSecrets(kPublic + kSecret.substr(0, digits)), kPublic + "***") << digits;
    }
    EXPECT_EQ(maskSecrets(kPublic + kSecret + kSecret + "x"), kPublic + "***x");
}

TEST(MaskSecrets, LeavesOtherTextAlone) {
    for (const std::string& text :
         {std::string(), std::string("shapedb"), std::string("shapedb_"), std::string("shapedb_bones"),
          kPublic, kPublic + "x", kPublic.substr(0, kPublic.size() - 2) + "_" + kSecret,
          std::string("shapedb_0123456789abcdeg_") + kSecret, kSecret}) {
        EXPECT_EQ(maskSecrets(text), text);
    }
}

}  // namespace
}  // namespace shapedb
