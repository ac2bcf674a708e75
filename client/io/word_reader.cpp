// SPDX-License-Identifier: Apache-2.0
#include "client/io/word_reader.h"

#include "client/io/text.h"

namespace shapedb::io {

void WordReader::skipLinesOf(std::string_view keyword, std::string_view other) {
    skipped_[0] = keyword;
    skipped_[1] = other;
}

bool WordReader::nextLine() {
    while (file_->readLine(rest_)) {
        rest_ = withoutComment(rest_);
        std::string_view rest = rest_;
        const std::string_view first = nextWord(rest);
        if (first.empty()) continue;
        if (!equalsIgnoringCase(first, skipped_[0]) && !equalsIgnoringCase(first, skipped_[1])) return true;
    }
    rest_ = {};
    ended_ = true;
    return false;
}

bool WordReader::atLineEnd() {
    while (!rest_.empty() && isBlank(rest_.front())) rest_.remove_prefix(1);
    return rest_.empty();
}

bool WordReader::lineGoesOnWith(std::string_view first, std::string_view second) const {
    std::string_view rest = rest_;
    return equalsIgnoringCase(nextWord(rest), first) && equalsIgnoringCase(nextWord(rest), second);
}

std::size_t WordReader::wordsOnLine() const {
    std::string_view rest = rest_;
    std::size_t words = 0;
    while (!nextWord(rest).empty()) ++words;
    return words;
}

std::string_view WordReader::next() {
    for (;;) {
        const std::string_view word = nextWord(rest_);
        if (!word.empty() || !nextLine()) return word;
    }
}

std::string_view WordReader::nextOnLine() { return nextWord(rest_); }

bool WordReader::hasFewerLinesThan(std::uint64_t records) {
    const std::uint64_t begun = atLineEnd() ? 0 : 1;
    // The rest of the line is a view into the buffer, which may move.
    line_ = rest_;
    rest_ = line_;
    const auto left = file_->contentLinesLeft();
    return left && begun + *left < records;
}

}  // namespace shapedb::io
