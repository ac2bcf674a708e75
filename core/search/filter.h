// Metadata filters: which shapes a search or a listing considers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb {

/// Terms separated by commas, all of which must hold: `key=value`, `key!=value`, `key` (present), `!key`
/// (absent), and `key<v`, `key<=v`, `key>v`, `key>=v` (numbers). Blanks around keys, operators and values
/// are ignored. A value with commas, operators, or blanks at its ends is written in double quotes, with \"
/// and \\ inside. A shape without the key passes no comparison except `!=`. An empty text accepts
/// everything. Keys have no blanks, commas, quotes or operator characters. Grammar: docs/filters.md.
///
/// Immutable; safe to share between threads.
class Filter {
  public:
    /// Accepts everything.
    Filter() = default;

    /// Errors: kMalformedFilter with the column (bytes, from 1) and what was expected there.
    [[nodiscard]] static Result<Filter> parse(const std::string& text);

    [[nodiscard]] bool matches(const std::map<std::string, std::string>& metadata) const;
    [[nodiscard]] bool acceptsAll() const { return terms_.empty(); }

  private:
    enum class Operator { kEqual, kNotEqual, kPresent, kAbsent, kLess, kLessEqual, kGreater, kGreaterEqual };
    struct Term {
        std::string key;
        Operator op = Operator::kEqual;
        std::string value;
        double number = 0.0;
    };

    static bool passes(const Term& term, const std::map<std::string, std::string>& metadata);

    std::vector<Term> terms_;

    friend class FilterParser;
};

}  // namespace shapedb
