// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/filter.h"

#include <cstdlib>

#include <gtest/gtest.h>

#include "core/base/metadata.h"
#include "core/base/random.h"

namespace shapedb {
namespace {

Filter parsed(const std::string& text) {
    auto filter = Filter::parse(text);
    EXPECT_TRUE(filter) << text << ": " << (filter ? "" : filter.error().message);
    return filter ? *filter : Filter();
}

TEST(Filter, AcceptsEverythingWhenEmpty) {
    EXPECT_TRUE(Filter().acceptsAll());
    for (const char* text : {"", " ", "\t  "}) {
        const Filter filter = parsed(text);
        EXPECT_TRUE(filter.acceptsAll());
        EXPECT_TRUE(filter.matches({}));
        EXPECT_TRUE(filter.matches({{"a", "b"}}));
    }
    EXPECT_FALSE(parsed("a").acceptsAll());
}

TEST(Filter, PassesWhatItSays) {
    const Metadata cup = {
        {"label", "cup"},     {"year", "1990"},         {"size", "-2.5e1"},          {"empty", ""},
        {"a.b/c-d_e:f", "x"}, {"größe", "klein, rund"}, {"quote", "say \"\\\" now"}, {"words", "two words"},
        {"text", "12abc"}};
    struct Case {
        const char* text;
        bool passes;
    };
    const std::vector<Case> cases = {
        {"label=cup", true},
        {"label=cups", false},
        {"label=CUP", false},
        {"label!=cup", false},
        {"label!=mug", true},
        {"label", true},
        {"!label", false},
        {"none", false},
        {"!none", true},
        {"! none", true},
        {"none=x", false},
        {"none!=x", true},
        {"none<1", false},
        {"none>=1", false},
        {"  label \t=  cup  ", true},
        {"label=\"cup\"", true},
        {"label=\" cup\"", false},
        {"words=two words", true},
        {"words = two words , label", true},
        {"words=\"two words\"", true},
        {"empty", true},
        {"empty=\"\"", true},
        {"label=\"\"", false},
        {"empty<1", false},
        {"a.b/c-d_e:f=x", true},
        {"größe=\"klein, rund\"", true},
        {"größe!=\"klein, rund\"", false},
        {"quote=\"say \\\"\\\\\\\" now\"", true},
        {"year=1990", true},
        {"year=1990.0", false},  // = compares text
        {"year<=1990.0", true},
        {"year<1990", false},
        {"year>1989.5", true},
        {"year>=1.99e3", true},
        {"year>\"1989\"", true},
        {"year > -1", true},
        {"size<-24.9", true},
        {"size<-25", false},
        {"size<=-25", true},
        {"text>0", false},
        {"label>0", false},
        {"label=cup,year=1990", true},
        {"label=cup, year=1991", false},
        {"label , year , !none", true},
        {"label=cup,label=mug", false},
        {"year>=1980,year<2000", true},
        {"label=mug|label=cup", true},
        {"label=mug | label = cup , year=1990", true},
        {"label=mug|label=bowl", false},
        {"label=cup|none, year=1991", false},  // of each condition one
        {"year=1991, label=cup|none", false},
        {"none|!label|year<0|year>1989", true},
        {"none|!label|year<0", false},
        {"none=\"a|b\"|label", true},
        {"label^=cu", true},
        {"label ^= cup", true},
        {"label^=\"\"", true},
        {"label^=cups", false},
        {"label^=up", false},
        {"none^=x", false},
        {"year^=19", true},
        {"@key=mug/mug_01", true},
        {"@key=mug/mug_02", false},
        {"@key!=mug/mug_02", true},
        {"@key^=mug/", true},
        {"@key^=cup/|label=cup", true},
        {"@key^=cup/, label=cup", false},
        {"@key", true},
        {"!@key", false},
    };
    for (const Case& c : cases) EXPECT_EQ(parsed(c.text).matches(cup, "mug/mug_01"), c.passes) << c.text;
}

TEST(Filter, RefusesTheRestAndSaysWhere) {
    struct Case {
        const char* text;
        int column;
        const char* expected;
    };
    const std::vector<Case> cases = {
        {",", 1, "a key"},
        {"a,", 3, "a key"},
        {"a,,b", 3, "a key"},
        {"=x", 1, "a key"},
        {"!", 2, "a key"},
        {"!!a", 2, "a key"},
        {"!=a", 2, "a key"},
        {"\"a\"=x", 1, "a key"},
        {"a b", 3, "one of"},
        {"a!b", 2, "one of"},
        {"a!", 2, "one of"},
        {"a \"b\"", 3, "one of"},
        {"a=", 3, "a value"},
        {"a=  ", 5, "a value"},
        {"a=,b", 3, "a value"},
        {"a==b", 3, "a value without operators"},
        {"a=b=c", 4, "a value without operators"},
        {"a=b\"c\"", 4, "a value without operators"},
        {"a<>3", 3, "a value without operators"},
        {"a=b<c", 4, "a value without operators"},
        {"a=\"b", 5, "a closing quote"},
        {"a=\"b\\\"", 7, "a closing quote"},
        {"a=\"b\\", 6, "a closing quote"},
        {"a=\"b\"c", 6, "','"},
        {"a=\"b\" \"c\"", 7, "','"},
        {"!a=b", 3, "','"},
        {"!a b", 4, "','"},
        {"a<b", 3, "a number"},
        {"a>=12x", 4, "a number"},
        {"a<inf", 3, "a number"},
        {"a<nan", 3, "a number"},
        {"a<1e999", 3, "a number"},
        {"a<0x10", 3, "a number"},
        {"a<+1", 3, "a number"},
        {"a<\"\"", 3, "a number"},
        {"a<\" 1\"", 3, "a number"},
        {"a<1 2", 3, "a number"},
        {"|a", 1, "a key"},
        {"a|", 3, "a key"},
        {"a||b", 3, "a key"},
        {"a,|b", 3, "a key"},
        {"a=1|b=", 7, "a value"},
        {"a=|b", 3, "a value"},
        {"a^=", 4, "a value"},
        {"a=\"b\" c|d", 7, "',', '|' or the end"},
        {"label=cup, year>=, x", 18, "a value"},
        {"ü=ä, =", 8, "a key"},  // columns are bytes
    };
    for (const Case& c : cases) {
        const auto filter = Filter::parse(c.text);
        ASSERT_FALSE(filter) << c.text;
        EXPECT_EQ(filter.error().code, ErrorCode::kMalformedFilter);
        const std::string& message = filter.error().message;
        EXPECT_NE(message.find("column " + std::to_string(c.column) + ":"), std::string::npos)
            << c.text << " should fail at " << c.column << ": " << message;
        EXPECT_NE(message.find("expected " + std::string(c.expected)), std::string::npos)
            << c.text << ": " << message;
        EXPECT_NE(message.find("'" + std::string(c.text) + "'"), std::string::npos) << message;
    }
}

TEST(Filter, MessageIsAsDocumented) {
    EXPECT_EQ(
        Filter::parse("a b").error().message,
        "filter 'a b', column 3: expected one of = != ^= < <= > >=; write for example label=cup, year>=1990, "
        "!draft");
}

TEST(Filter, MessageIsOneShortLineWhateverTheText) {
    const std::string longValue(1000000, 'x');
    const auto tooLong = Filter::parse("a=" + longValue + ",=" + longValue);
    ASSERT_FALSE(tooLong);
    EXPECT_LT(tooLong.error().message.size(), 300u);
    EXPECT_NE(tooLong.error().message.find("column 1000004"), std::string::npos) << tooLong.error().message;
    const auto lines = Filter::parse(std::string("a=b\r\n\0\x7f,=", 9));
    ASSERT_FALSE(lines);
    for (const char c : lines.error().message) EXPECT_GE(static_cast<unsigned char>(c), 0x20u);
    // Cut between characters: every ü is whole.
    std::string umlauts;
    for (int i = 0; i < 200; ++i) umlauts += "ü";
    for (const std::string shift : {"", "x"}) {
        const auto cut = Filter::parse(shift + umlauts + " ?" + umlauts);
        ASSERT_FALSE(cut);
        std::string rest = cut.error().message;
        for (std::size_t at; (at = rest.find("ü")) != std::string::npos;) rest.erase(at, 2);
        for (const char c : rest) EXPECT_LT(static_cast<unsigned char>(c), 0x80u) << rest;
    }
}

// An evaluator that never saw the parser: terms are made, written down and judged separately.
struct PlainTerm {
    std::string key, op, value;

    bool passes(const Metadata& metadata) const {
        const bool present = metadata.count(key) != 0;
        if (op == "present") return present;
        if (op == "absent") return !present;
        if (!present) return op == "!=";
        const std::string& text = metadata.at(key);
        if (op == "=") return text == value;
        if (op == "!=") return text != value;
        if (op == "^=") return text.rfind(value, 0) == 0;
        if (text.empty() || text[0] == '+' ||
            text.find_first_not_of("0123456789.eE+-") != std::string::npos) {
            return false;
        }
        char* end = nullptr;
        const double left = std::strtod(text.c_str(), &end);
        if (*end != '\0') return false;
        const double right = std::strtod(value.c_str(), nullptr);
        if (op == "<") return left < right;
        if (op == "<=") return left <= right;
        if (op == ">") return left > right;
        return left >= right;
    }

    std::string written(Random& random) const {
        const auto blanks = [&] { return std::string(random.below(3), random.below(2) == 0 ? ' ' : '\t'); };
        if (op == "present") return blanks() + key + blanks();
        if (op == "absent") return blanks() + "!" + blanks() + key + blanks();
        const bool mustQuote = value.empty() || value.find_first_of(",|\"=!<>") != std::string::npos ||
                               std::string(" \t").find(value.front()) != std::string::npos ||
                               std::string(" \t").find(value.back()) != std::string::npos;
        std::string shown = value;
        if (mustQuote || random.below(3) == 0) {
            shown = "\"";
            for (const char c : value) {
                if (c == '"' || c == '\\') shown += '\\';
                shown += c;
            }
            shown += "\"";
        }
        return blanks() + key + blanks() + op + blanks() + shown + blanks();
    }
};

std::string pick(Random& random, const std::vector<std::string>& from) {
    return from[random.below(from.size())];
}

TEST(Filter, AgreesWithAnIndependentEvaluator) {
    Random random(1);
    const std::vector<std::string> keys = {"label", "year", "größe", "a.b", "x", "1", "-", "日本"};
    const std::vector<std::string> numbers = {"0",       "1",  "-1",   "1.5", "1e3",
                                              "-2.5E-1", ".5", "1000", "007", "2."};
    const std::vector<std::string> texts = {
        "",   "cup",  "two words", "a,b", "a=b", " lead", "trail\t", "\"",          "\\", "\\\"",
        "!x", "日本", "c|u",       "cu",  "12x", "inf",   "+1",      "line\nbreak", "1 "};
    int passed = 0;
    const int rounds = 20000;
    for (int round = 0; round < rounds; ++round) {
        Metadata metadata;
        for (std::uint64_t i = random.below(6); i > 0; --i) {
            metadata[pick(random, keys)] = pick(random, random.below(2) == 0 ? numbers : texts);
        }
        bool expected = true;
        std::string text;
        for (std::uint64_t conditions = 1 + random.below(3); conditions > 0; --conditions) {
            bool holds = false;
            if (!text.empty()) text += ",";
            for (std::uint64_t i = 1 + random.below(2); i > 0; --i) {
                PlainTerm term{pick(random, keys),
                               pick(random, {"present", "absent", "=", "!=", "^=", "<", "<=", ">", ">="}),
                               ""};
                const bool ordered = term.op.front() == '<' || term.op.front() == '>';
                term.value = pick(random, ordered || random.below(2) == 0 ? numbers : texts);
                text += term.written(random) + (i > 1 ? "|" : "");
                holds = term.passes(metadata) || holds;
            }
            expected = expected && holds;
        }
        const auto filter = Filter::parse(text);
        ASSERT_TRUE(filter) << text << ": " << filter.error().message;
        ASSERT_EQ(filter->matches(metadata), expected) << text;
        passed += expected ? 1 : 0;
    }
    EXPECT_GT(passed, rounds / 10);
    EXPECT_LT(passed, rounds * 9 / 10);
}

TEST(Filter, SurvivesAnyBytes) {
    Random random(2);
    const std::string likely = "ab=!<>^|@key,\"\\ \t1.5e-";
    const Metadata metadata = {{"a", "1"}, {"b", "x"}, {"ab", ""}};
    int accepted = 0;
    for (int round = 0; round < 200000; ++round) {
        std::string text;
        for (std::uint64_t i = random.below(16); i > 0; --i) {
            text += random.below(10) == 0 ? static_cast<char>(random.below(256))
                                          : likely[random.below(likely.size())];
        }
        const auto filter = Filter::parse(text);
        if (filter) {
            (void)filter->matches(metadata);
            ++accepted;
            continue;
        }
        ASSERT_EQ(filter.error().code, ErrorCode::kMalformedFilter);
        // The column lies in the text or right behind it.
        const std::string& message = filter.error().message;
        const std::size_t at = message.rfind("column ");
        ASSERT_NE(at, std::string::npos);
        const int column = std::atoi(message.c_str() + at + 7);
        ASSERT_GE(column, 1);
        ASSERT_LE(column, static_cast<int>(text.size()) + 1);
    }
    EXPECT_GT(accepted, 1000);
}

}  // namespace
}  // namespace shapedb
