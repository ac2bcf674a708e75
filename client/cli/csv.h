// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of CSV files as RFC 4180 has them, but with lines that end as on Unix.
#pragma once

#include <string>

#include "client/cli/text.h"

namespace shapedb::cli {

class CsvRow {
  public:
    CsvRow& add(const std::string& cell) {
        if (!first_) line_ += ',';
        first_ = false;
        if (cell.find_first_of(",\"\r\n") == std::string::npos) {
            line_ += cell;
            return *this;
        }
        line_ += '"';
        for (const char c : cell) line_ += c == '"' ? std::string("\"\"") : std::string(1, c);
        line_ += '"';
        return *this;
    }
    CsvRow& add(const char* cell) { return add(std::string(cell)); }
    CsvRow& add(double value) { return add(exactNumber(value)); }

    [[nodiscard]] std::string line() const { return line_ + "\n"; }

  private:
    std::string line_;
    bool first_ = true;
};

}  // namespace shapedb::cli
