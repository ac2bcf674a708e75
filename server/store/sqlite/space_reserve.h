// SPDX-License-Identifier: GPL-3.0-or-later
// Space on the disk that is kept for deletions: to delete, SQLite must write first.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include "core/base/error.h"

namespace shapedb::store {

/// A file that takes space and holds nothing. Thread-safe.
class SpaceReserve {
  public:
    /// The log of many deletions between two checkpoints.
    static constexpr std::uint64_t kBytes = std::uint64_t{16} << 20;

    explicit SpaceReserve(std::string path, std::uint64_t bytes = kBytes);
    ~SpaceReserve();
    SpaceReserve(const SpaceReserve&) = delete;
    SpaceReserve& operator=(const SpaceReserve&) = delete;

    /// Takes the space, if that has not happened yet. Before anything that lets the database grow. Errors:
    /// kStorageFull (there is none). Where space cannot be taken for another reason, such as a limit of file
    /// sizes, there is no reserve, and no error.
    [[nodiscard]] Result<void> hold();
    /// Frees the space for the next write. False if there was none to give.
    bool release();

    /// While it lives, the space is given to its owner, and `hold` waits. At its end the space is taken back,
    /// if it is there.
    class Loan {
      public:
        explicit Loan(SpaceReserve& reserve);
        ~Loan();
        Loan(const Loan&) = delete;
        Loan& operator=(const Loan&) = delete;

      private:
        SpaceReserve& reserve_;
        const std::lock_guard<std::mutex> lock_;
    };

  private:
    Result<void> take();
    bool give();

    const std::string path_;
    const std::uint64_t bytes_;
    std::mutex mutex_;
    int file_ = -1;
    bool held_ = false;
};

}  // namespace shapedb::store
