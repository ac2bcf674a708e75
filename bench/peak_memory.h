// SPDX-License-Identifier: GPL-3.0-or-later
// Peak memory of a piece of work, whatever this process did before.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>

namespace shapedb::bench {

/// Runs `work` in a forked child and returns the child's peak resident memory in bytes, above that of a
/// child that does nothing; nothing if the child cannot be started or fails. Call it before this
/// process starts threads: the child has only the one that forked.
[[nodiscard]] std::optional<std::size_t> peakMemoryOf(const std::function<bool()>& work);

}  // namespace shapedb::bench
