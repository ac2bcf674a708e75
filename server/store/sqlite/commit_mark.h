// SPDX-License-Identifier: GPL-3.0-or-later
// How many changes were acknowledged, kept outside the database.
//
// SQLite ignores a damaged end of its write-ahead log, and a log that was removed: it opens an older state
// and says nothing. The database counts its commits; this file remembers the last count that was
// acknowledged, so that the loss is noticed at the next start.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace shapedb::store {

/// A small file beside the database, private to its owner. It survives the death of the process; after a
/// power failure it may be behind, never ahead. Not thread-safe. Without a file that can be written, it
/// remembers nothing.
class CommitMark {
  public:
    explicit CommitMark(const std::string& path);
    ~CommitMark();
    CommitMark(const CommitMark&) = delete;
    CommitMark& operator=(const CommitMark&) = delete;

    /// Nothing if there is no mark, or a damaged one.
    [[nodiscard]] std::optional<std::int64_t> read() const noexcept;
    void write(std::int64_t commits) const noexcept;
    /// Whether what was written, and the file's name, survive a power failure: then a mark that is missing
    /// later was not lost so.
    bool sync() const noexcept;

  private:
    const std::string folder_;
    int file_;
};

}  // namespace shapedb::store
