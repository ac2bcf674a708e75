// SPDX-License-Identifier: GPL-3.0-or-later
// What became of many items of which some failed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/console.h"
#include "core/base/error.h"

namespace shapedb::cli {

/// After such an error the other items would fail too.
[[nodiscard]] bool endsTheCommand(const Error& error) noexcept;

/// Failures of single items. Not thread-safe.
class Failures {
  public:
    void add(std::string item, Error error) { failures_.push_back({std::move(item), std::move(error)}); }

    [[nodiscard]] bool empty() const { return failures_.empty(); }
    [[nodiscard]] std::size_t size() const { return failures_.size(); }

    /// A note for each; those with the same message share one, which names the first and counts the others.
    /// Then, of several items, how many of `all` failed: "2 of 3 files failed".
    void tell(Console& console, std::size_t all, const char* singular, const char* plural) const;

    /// kOk without failures; that of the error if all items failed and there is one, or all for lack of a
    /// server; otherwise kSomeFailed.
    [[nodiscard]] int exitCode(std::size_t all) const;

  private:
    struct Failure {
        std::string item;
        Error error;
    };
    std::vector<Failure> failures_;
};

}  // namespace shapedb::cli
