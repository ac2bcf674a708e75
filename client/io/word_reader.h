// SPDX-License-Identifier: Apache-2.0
// The words of a text file, over the ends of lines. Private to client/io.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "client/io/input_file.h"

namespace shapedb::io {

/// Blank lines and what follows a '#' are no words. Words are valid until the next call that may read a line.
class WordReader {
  public:
    explicit WordReader(InputFile& file) : file_(&file) {}

    /// Also skips lines that begin with such a word and a blank: "comment" in PLY.
    void skipLinesOf(std::string_view keyword, std::string_view other);

    /// Drops the rest of the line and goes to the next that has a word; false at the end of the file.
    bool nextLine();
    void endLine() { rest_ = {}; }
    /// True if there is no word left on the line.
    bool atLineEnd();
    /// True if these are the next words of the line, in any case; both must be lower case.
    bool lineGoesOnWith(std::string_view first, std::string_view second) const;
    /// Words left on the line.
    std::size_t wordsOnLine() const;
    /// The next word of this line or a later one; empty at the end of the file.
    std::string_view next();
    /// The next word of this line; empty at its end.
    std::string_view nextOnLine();
    /// True once there was no line left.
    bool ended() const { return ended_; }

    /// One record per line is what every writer does, but line ends are no more than blanks to the formats.
    /// So only a file that has fewer lines left than `records` is read word by word. Unknown in a long file:
    /// false.
    bool hasFewerLinesThan(std::uint64_t records);

  private:
    InputFile* file_;
    std::string_view rest_;
    std::string line_;  ///< what rest_ shows after hasFewerLinesThan
    std::array<std::string_view, 2> skipped_;
    bool ended_ = false;
};

}  // namespace shapedb::io
