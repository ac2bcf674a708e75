// SPDX-License-Identifier: GPL-3.0-or-later
// Metadata filters: which shapes a search or a listing considers.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace shapedb {

/// Conditions separated by commas, all of which must hold; a condition is one term, or several separated by
/// `|`, of which one must hold. Terms: `key=value`, `key!=value`, `key^=start` (begins with), `key`
/// (present),
/// `!key` (absent), and `key<v`, `key<=v`, `key>v`, `key>=v` (numbers). `@key` is the shape's own key. Blanks
/// around keys, operators and values are ignored. A value with commas, bars, operators, or blanks at its ends
/// is written in double quotes, with \" and \\ inside. A shape without the key passes no comparison except
/// `!=`. An empty text accepts everything. Keys have no blanks, commas, bars, quotes or operator characters.
/// Grammar: docs/filters.md.
///
/// Immutable; safe to share between threads.
class Filter {
  public:
    /// Accepts everything.
    Filter() = default;

    /// Errors: kMalformedFilter with the column (bytes, from 1) and what was expected there.
    [[nodiscard]] static Result<Filter> parse(const std::string& text);

    /// `shapeKey`: the shape's own.
    [[nodiscard]] bool matches(const std::map<std::string, std::string>& metadata,
                               std::string_view shapeKey = {}) const;
    [[nodiscard]] bool acceptsAll() const { return conditions_.empty(); }
    /// As it was parsed.
    [[nodiscard]] const std::string& text() const { return text_; }
    /// False: shapes with equal metadata pass alike.
    [[nodiscard]] bool asksForKeys() const { return asksForKeys_; }

  private:
    enum class Operator {
        kEqual,
        kNotEqual,
        kBegins,
        kPresent,
        kAbsent,
        kLess,
        kLessEqual,
        kGreater,
        kGreaterEqual
    };
    struct Term {
        std::string key;
        Operator op = Operator::kEqual;
        std::string value;
        double number = 0.0;
        bool ofShapeKey = false;
    };
    /// Alternatives: at least one, any of which will do.
    using Condition = std::vector<Term>;

    /// `value`: null if there is none.
    static bool passes(const Term& term, const std::string_view* value);

    std::string text_;
    std::vector<Condition> conditions_;
    bool asksForKeys_ = false;

    friend class FilterParser;
};

}  // namespace shapedb
