// SPDX-License-Identifier: GPL-3.0-or-later
// Any number of signatures of made-up shapes, to measure searches on. Their scores are distributed like those
// of real shapes; docs/benchmarks.md compares the two.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/signature.h"

namespace shapedb::bench {

enum class Mixture {
    kPlain,       ///< classes differ, and shapes within them agree, as in a labelled collection
    kDuplicates,  ///< every tenth is a near copy of another: scans of one object
    kHard,        ///< few classes of shapes more alike than usual
};
[[nodiscard]] const char* name(Mixture mixture) noexcept;

/// Anchors are signatures of scans of the synthetic families (core/synthetic): about 100, with 0.2 %
/// noise. A class is a blend of two of them; a shape of the class is its blend
/// with a third, with parts moved, resized, removed and added.
///
/// Immutable; `make` may be called from any number of threads.
class SignatureGenerator {
  public:
    struct Options {
        Mixture mixture = Mixture::kPlain;
        /// Size of the collection; the number of classes grows with its square root.
        std::uint64_t expected = 1000;
        std::uint64_t seed = 1;
        std::size_t points = 3000;  ///< of each scan behind an anchor
        std::size_t members = 8;    ///< of each family
    };
    /// Takes seconds. Errors: kCancelled.
    [[nodiscard]] static Result<SignatureGenerator> create(const Options& options, const RunContext& context);

    /// Shape `index`: the same for the same options. As decodeSignature(encodeSignature()) would give it.
    [[nodiscard]] Signature make(std::uint64_t index) const;
    [[nodiscard]] std::size_t classOf(std::uint64_t index) const;
    [[nodiscard]] std::size_t classes() const { return classes_; }
    [[nodiscard]] std::size_t anchors() const { return anchors_.size(); }

  private:
    SignatureGenerator() = default;

    Signature ofClass(std::uint64_t index) const;

    std::vector<Signature> anchors_;
    Mixture mixture_ = Mixture::kPlain;
    std::size_t classes_ = 1;
    std::uint64_t seed_ = 1;
};

}  // namespace shapedb::bench
