// SPDX-License-Identifier: Apache-2.0
// The two ways to read one record of a PLY element, with one interface. Private to client/io.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "client/io/input_file.h"
#include "client/io/ply_header.h"
#include "client/io/scalar.h"
#include "client/io/text.h"
#include "client/io/word_reader.h"

namespace shapedb::io {

inline std::string recordName(const PlyElement& element, std::uint64_t index) {
    return element.name + " " + std::to_string(index) + " of " + std::to_string(element.count);
}

/// One element per line. A record may go on on the next line, but then ends with it, so that a missing number
/// is found where it is missing; only a file with fewer lines than records is read word by word.
class TextRecord {
  public:
    TextRecord(InputFile& file, WordReader& words, bool wordByWord)
        : file_(&file), words_(&words), wordByWord_(wordByWord) {}

    bool begin() {
        if (words_->atLineEnd() && !words_->nextLine()) return false;
        line_ = file_->lineNumber();
        return true;
    }

    bool real(ScalarType, double& value) { return parseReal(next(), value); }
    bool integer(ScalarType, std::int64_t& value) { return parseInteger(next(), value); }
    bool skip(ScalarType, std::uint64_t count) {
        for (; count > 0; --count) {
            if (next().empty()) return false;
        }
        return true;
    }
    bool end() { return wordByWord_ || words_->atLineEnd() || next().empty(); }

    std::string where() const { return "line " + std::to_string(file_->lineNumber()); }

    Error error(const PlyElement& element, std::uint64_t index, const std::string& property) const {
        if (words_->ended()) {
            return file_->malformed("the file ends after line " + std::to_string(file_->lineNumber()) +
                                    ": expected " + (property.empty() ? "" : property + " of ") +
                                    recordName(element, index));
        }
        const std::string begun =
            line_ < file_->lineNumber() ? ", which begins in line " + std::to_string(line_) : "";
        return file_->malformedLine("expected " + property + " of " + recordName(element, index) + begun +
                                    ", found " + inQuotesNotANumber(word_));
    }

  private:
    std::string_view next() { return word_ = words_->next(); }

    InputFile* file_;
    WordReader* words_;
    bool wordByWord_;
    std::uint64_t line_ = 0;
    std::string_view word_;
};

class BinaryRecord {
  public:
    BinaryRecord(InputFile& file, bool swapped) : file_(&file), swapped_(swapped) {}

    bool begin() {
        start_ = file_->offset();
        return true;
    }

    bool real(ScalarType type, double& value) {
        const std::size_t size = scalarSize(type);
        if (!file_->fill(size)) return false;
        value = loadScalar(file_->data(), type, swapped_);
        file_->consume(size);
        return true;
    }
    bool integer(ScalarType type, std::int64_t& value) {
        double number = 0.0;
        if (!real(type, number)) return false;
        // No list is as long, and no vertex has such a number.
        constexpr double kMost = 9e18;
        value = static_cast<std::int64_t>(std::clamp(number, -kMost, kMost));
        return true;
    }
    bool skip(ScalarType type, std::uint64_t count) {
        return count <= std::numeric_limits<std::uint64_t>::max() / scalarSize(type) &&
               file_->skip(count * scalarSize(type));
    }
    bool end() { return true; }

    std::string where() const { return "byte " + std::to_string(start_); }

    Error error(const PlyElement& element, std::uint64_t index, const std::string& property) const {
        return file_->malformedByte(
            start_, "the file ends inside " + recordName(element, index) + ": expected " + property);
    }

  private:
    InputFile* file_;
    bool swapped_;
    std::uint64_t start_ = 0;
};

}  // namespace shapedb::io
