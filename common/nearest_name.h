// SPDX-License-Identifier: Apache-2.0
// Which name was meant by a mistyped one, of a command, a flag or a setting.
#pragma once

#include <string>
#include <vector>

namespace shapedb {

/// The name that was probably meant by `typed`; empty if none is near.
[[nodiscard]] std::string nearestName(const std::string& typed, const std::vector<std::string>& names);

/// ": did you mean 'NAME'?"; empty for an empty name.
[[nodiscard]] std::string didYouMean(const std::string& name);

/// "--threshold" for each long name of the options, pointers to CLI::Option, which this header does not know.
template <typename Options>
[[nodiscard]] std::vector<std::string> longFlags(const Options& options) {
    std::vector<std::string> flags;
    for (const auto* option : options) {
        for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
    }
    return flags;
}

/// "unknown option '--thresold': did you mean '--threshold'?" for a word that no flag takes, perhaps with
/// "=VALUE". `flags`: those that there are.
[[nodiscard]] std::string unknownOption(const std::string& word, const std::vector<std::string>& flags);

}  // namespace shapedb
