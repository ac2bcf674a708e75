#include "server/catalog/cursor.h"

#include <limits>

#include <gtest/gtest.h>

namespace shapedb::catalog {
namespace {

TEST(Cursor, DecodesWhatItEncoded) {
    const Listing listing{7, "label=cup, year>=1990", 2};
    for (const std::int64_t id :
         {std::int64_t{1}, std::int64_t{255}, std::numeric_limits<std::int64_t>::max()}) {
        const auto decoded = decodeCursor(listing, encodeCursor(listing, id));
        ASSERT_TRUE(decoded) << decoded.error().message;
        EXPECT_EQ(*decoded, id);
    }
}

TEST(Cursor, EmptyCursorIsTheStart) { EXPECT_EQ(*decodeCursor({1, "", 0}, ""), 0); }

TEST(Cursor, IsPlainText) {
    for (const char c : encodeCursor({1, "x", 0}, 42))
        EXPECT_TRUE(std::isalnum(static_cast<unsigned char>(c)));
}

TEST(Cursor, RefusesTheCursorOfAnotherListing) {
    const std::string cursor = encodeCursor({7, "a", 1}, 42);
    for (const Listing& other :
         {Listing{8, "a", 1}, Listing{7, "b", 1}, Listing{7, "", 1}, Listing{7, "a", 2}}) {
        const auto decoded = decodeCursor(other, cursor);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kMalformedCursor);
    }
}

// Text moved from one field to the next gives another listing.
TEST(Cursor, DistinguishesListingsWithSimilarFields) {
    EXPECT_NE(encodeCursor({1, "2 x", 0}, 5), encodeCursor({1, "x", 2}, 5));
    EXPECT_FALSE(decodeCursor({1, "1 x", 0}, encodeCursor({1, "x", 0}, 5)));
}

TEST(Cursor, DetectsDamage) {
    const Listing listing{7, "a", 1};
    const std::string cursor = encodeCursor(listing, 42);
    for (std::size_t i = 0; i < cursor.size(); ++i) {
        for (const char c : {'0', '1', 'f', 'g', 'A', ' ', '\0'}) {
            std::string damaged = cursor;
            if (damaged[i] == c) continue;
            damaged[i] = c;
            EXPECT_FALSE(decodeCursor(listing, damaged)) << damaged;
        }
        EXPECT_FALSE(decodeCursor(listing, cursor.substr(0, i)).has_value() && i > 0) << i;
    }
    EXPECT_FALSE(decodeCursor(listing, cursor + "0"));
}

}  // namespace
}  // namespace shapedb::catalog
