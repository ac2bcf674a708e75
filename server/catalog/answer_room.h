// SPDX-License-Identifier: GPL-3.0-or-later
// How much the answers of all calls may take in memory together, and each by itself.
#pragma once

#include <cstddef>
#include <mutex>

#include "core/base/error.h"
#include "server/catalog/gates.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {

/// How many bytes an answer may still grow by. One for each request, kept until the answer is written: a
/// client that does not read keeps it in memory. Thread-safe.
class AnswerRoom {
  public:
    /// `all`: what the answers of all calls may take together; must outlive this.
    explicit AnswerRoom(Budget& all) : share_(all) {}

    /// Errors: kInvalidArgument, saying how to ask for less; kQueueFull (the answers of other calls).
    [[nodiscard]] Result<void> take(std::size_t bytes);

  private:
    std::mutex mutex_;
    std::size_t left_ = kMaxAnswerBytes;
    Budget::Share share_;
};

}  // namespace shapedb::catalog
