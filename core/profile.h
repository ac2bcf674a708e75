// SPDX-License-Identifier: Apache-2.0
// The named sets of parameters. core/pipeline.h has their values.
#pragma once

namespace shapedb {

/// The numbers are persisted in collection parameters: never renumber.
enum class Profile : int {
    kPaper = 0,    ///< Dey and Goswami 2004 as published: every point as it is; points and weights alone
    kDefault = 1,  ///< recommended: made robust against noise, outliers and uneven density
};

/// "paper" or "default".
[[nodiscard]] inline const char* profileName(Profile profile) noexcept {
    switch (profile) {
        case Profile::kPaper: return "paper";
        case Profile::kDefault: return "default";
    }
    return "default";
}

}  // namespace shapedb
