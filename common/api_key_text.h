// SPDX-License-Identifier: Apache-2.0
// How API keys are written, and how they are kept out of what others read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace shapedb {

/// A key is "shapedb_ID_SECRET", both in hexadecimal digits.
constexpr std::string_view kApiKeyPrefix = "shapedb_";
constexpr std::size_t kApiKeyIdDigits = 16;
constexpr std::size_t kApiKeySecretDigits = 64;

/// `text` without the secrets in it: "shapedb_ID_***" is left of each, also of one in capitals or of which
/// only a part is there. For all that is written of clients' words: a key may be sent in the place of a name.
[[nodiscard]] std::string maskSecrets(std::string_view text);

}  // namespace shapedb
