// SPDX-License-Identifier: Apache-2.0
// What a hit may be to the query: for client and server alike.
#pragma once

namespace shapedb {

enum class Verdict {
    kNone,            ///< not verified: nothing is said
    kSameObject,      ///< another scan of it, whole or of one side
    kSameObjectBent,  ///< its parts are where joints or bending may have brought them
    kPart,            ///< the query is a piece of it
    kSameKind,        ///< another object of the same kind
    kUnrelated,
};

/// "same_object", "same_object_bent", "part", "same_kind", "unrelated"; "" for kNone.
[[nodiscard]] constexpr const char* verdictName(Verdict verdict) noexcept {
    switch (verdict) {
        case Verdict::kNone: return "";
        case Verdict::kSameObject: return "same_object";
        case Verdict::kSameObjectBent: return "same_object_bent";
        case Verdict::kPart: return "part";
        case Verdict::kSameKind: return "same_kind";
        case Verdict::kUnrelated: return "unrelated";
    }
    return "";
}

}  // namespace shapedb
