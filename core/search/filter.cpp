// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/filter.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

bool isBlank(char c) { return c == ' ' || c == '\t'; }
bool isOperator(char c) { return c == '=' || c == '!' || c == '<' || c == '>'; }
bool endsTerm(char c) { return c == ',' || c == '|'; }

/// Stands for the shape's own key. No key of metadata has an '@' (catalog/request_checks.h).
constexpr std::string_view kShapeKey = "@key";

bool parseNumber(std::string_view text, double& value) {
    // Unlike strtod, from_chars does not depend on the locale.
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end && std::isfinite(value);
}

}  // namespace

class FilterParser {
  public:
    explicit FilterParser(const std::string& text) : text_(text) {}

    Result<Filter> parse() {
        Filter filter;
        skipBlanks();
        if (atEnd()) return filter;
        filter.conditions_.emplace_back();
        while (true) {
            auto term = parseTerm();
            RETURN_IF_ERROR(term);
            filter.asksForKeys_ = filter.asksForKeys_ || term->ofShapeKey;
            filter.conditions_.back().push_back(std::move(*term));
            skipBlanks();
            if (atEnd()) return filter;
            if (!endsTerm(text_[at_])) return expected("',', '|' or the end");
            if (text_[at_] == ',') filter.conditions_.emplace_back();
            ++at_;
            skipBlanks();
        }
    }

  private:
    using Operator = Filter::Operator;

    bool atEnd() const { return at_ >= text_.size(); }
    void skipBlanks() {
        while (!atEnd() && isBlank(text_[at_])) ++at_;
    }
    tl::unexpected<Error> expected(const std::string& what) const {
        return fail(ErrorCode::kMalformedFilter, "filter '" + excerpt() + "', column " +
                                                     std::to_string(at_ + 1) + ": expected " + what +
                                                     "; write for example label=cup, year>=1990, !draft");
    }

    // The text around the error, on one line: never cut inside a UTF-8 character, control characters
    // shown as '?'.
    std::string excerpt() const {
        constexpr std::size_t kContext = 40;
        const auto continues = [&](std::size_t i) {
            return i < text_.size() && (static_cast<unsigned char>(text_[i]) & 0xc0u) == 0x80u;
        };
        std::size_t begin = at_ > kContext ? at_ - kContext : 0;
        std::size_t end = std::min(text_.size(), at_ + kContext);
        while (begin < at_ && continues(begin)) ++begin;
        while (end > at_ && continues(end)) --end;
        std::string shown = text_.substr(begin, end - begin);
        for (char& c : shown) {
            if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
        }
        return (begin > 0 ? "..." : "") + shown + (end < text_.size() ? "..." : "");
    }

    Result<Filter::Term> parseTerm() {
        Filter::Term term;
        const bool absent = !atEnd() && text_[at_] == '!';
        if (absent) ++at_;
        skipBlanks();
        term.key = parseKey();
        if (term.key.empty()) return expected("a key");
        term.ofShapeKey = term.key == kShapeKey;
        skipBlanks();
        if (absent) {
            term.op = Operator::kAbsent;
            return term;
        }
        if (atEnd() || endsTerm(text_[at_])) {
            term.op = Operator::kPresent;
            return term;
        }
        if (!parseOperator(term.op)) return expected("one of = != ^= < <= > >=");
        skipBlanks();
        return parseValueOf(std::move(term));
    }

    std::string parseKey() {
        const std::size_t begin = at_;
        while (!atEnd() && !isBlank(text_[at_]) && !isOperator(text_[at_]) && !endsTerm(text_[at_]) &&
               text_[at_] != '"' && text_.compare(at_, 2, "^=") != 0) {
            ++at_;
        }
        return text_.substr(begin, at_ - begin);
    }

    bool parseOperator(Operator& op) {
        const auto take = [&](const char* symbol, Operator meaning) {
            const std::string wanted(symbol);
            if (text_.compare(at_, wanted.size(), wanted) != 0) return false;
            at_ += wanted.size();
            op = meaning;
            return true;
        };
        // Longer ones first: < is also the beginning of <=.
        return take("!=", Operator::kNotEqual) || take("^=", Operator::kBegins) ||
               take("<=", Operator::kLessEqual) || take(">=", Operator::kGreaterEqual) ||
               take("=", Operator::kEqual) || take("<", Operator::kLess) || take(">", Operator::kGreater);
    }

    Result<Filter::Term> parseValueOf(Filter::Term term) {
        const std::size_t begin = at_;
        if (!atEnd() && text_[at_] == '"') {
            if (!parseQuoted(term.value)) return expected("a closing quote");
        } else {
            while (!atEnd() && !endsTerm(text_[at_])) {
                if (isOperator(text_[at_]) || text_[at_] == '"')
                    return expected("a value without operators, or quotes around it");
                ++at_;
            }
            std::size_t end = at_;
            while (end > begin && isBlank(text_[end - 1])) --end;
            term.value = text_.substr(begin, end - begin);
            if (term.value.empty()) return expected("a value");
        }
        const bool ordered =
            term.op != Operator::kEqual && term.op != Operator::kNotEqual && term.op != Operator::kBegins;
        if (ordered && !parseNumber(term.value, term.number)) {
            at_ = begin;
            return expected("a number after an order comparison");
        }
        return term;
    }

    bool parseQuoted(std::string& value) {
        for (++at_; !atEnd(); ++at_) {
            if (text_[at_] == '"') {
                ++at_;
                return true;
            }
            if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
            value.push_back(text_[at_]);
        }
        return false;
    }

    const std::string& text_;
    std::size_t at_ = 0;
};

Result<Filter> Filter::parse(const std::string& text) {
    auto filter = FilterParser(text).parse();
    if (filter) filter->text_ = text;
    return filter;
}

bool Filter::matches(const std::map<std::string, std::string>& metadata, std::string_view shapeKey) const {
    const auto holds = [&](const Term& term) {
        if (term.ofShapeKey) return passes(term, &shapeKey);
        const auto found = metadata.find(term.key);
        if (found == metadata.end()) return passes(term, nullptr);
        const std::string_view value = found->second;
        return passes(term, &value);
    };
    return std::all_of(conditions_.begin(), conditions_.end(), [&](const Condition& condition) {
        return std::any_of(condition.begin(), condition.end(), holds);
    });
}

bool Filter::passes(const Term& term, const std::string_view* value) {
    if (value == nullptr) return term.op == Operator::kAbsent || term.op == Operator::kNotEqual;
    double number = 0.0;
    switch (term.op) {
        case Operator::kPresent: return true;
        case Operator::kAbsent: return false;
        case Operator::kEqual: return *value == term.value;
        case Operator::kNotEqual: return *value != term.value;
        case Operator::kBegins: return value->substr(0, term.value.size()) == term.value;
        case Operator::kLess: return parseNumber(*value, number) && number < term.number;
        case Operator::kLessEqual: return parseNumber(*value, number) && number <= term.number;
        case Operator::kGreater: return parseNumber(*value, number) && number > term.number;
        case Operator::kGreaterEqual: return parseNumber(*value, number) && number >= term.number;
    }
    return false;
}

}  // namespace shapedb
