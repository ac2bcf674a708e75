// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/listing.h"

#include <limits>

#include <gtest/gtest.h>

namespace shapedb::catalog {
namespace {

using store::ShapeListing;
using store::ShapeOrder;

ShapeListing::Place place(std::int64_t id, store::TimestampMs updatedAt = 0, const std::string& key = {}) {
    return {id, updatedAt, key};
}

TEST(Cursor, DecodesWhatItEncoded) {
    Listing listing{7, "label=cup, year>=1990", 2, "a/"};
    for (const bool descending : {false, true}) {
        listing.descending = descending;
        for (const std::int64_t number :
             {std::int64_t{1}, std::int64_t{255}, std::numeric_limits<std::int64_t>::max()}) {
            const auto given =
                place(number, -number, std::string("a/\xc3\xa4 \x7f") + std::to_string(number));
            const auto decode = [&](ShapeOrder order) {
                listing.order = order;
                return decodeCursor(listing, encodeCursor(listing, given)).value().value();
            };
            EXPECT_EQ(decode(ShapeOrder::kId).id, given.id);
            EXPECT_EQ(decode(ShapeOrder::kUpdated).id, given.id);
            EXPECT_EQ(decode(ShapeOrder::kUpdated).updatedAt, given.updatedAt);
            EXPECT_EQ(decode(ShapeOrder::kKey).key, given.key);
        }
    }
}

TEST(Cursor, EmptyCursorIsTheStart) { EXPECT_FALSE(decodeCursor({1, "", 0}, "").value()); }

TEST(Cursor, IsPlainText) {
    for (const char c : encodeCursor({1, "x", 0, "", ShapeOrder::kKey}, place(42, 0, "\xc3\xa4 /")))
        EXPECT_TRUE(std::isalnum(static_cast<unsigned char>(c)));
}

TEST(Cursor, RefusesTheCursorOfAnotherListing) {
    const std::string cursor = encodeCursor({7, "a", 1, "p"}, place(42));
    for (const Listing& other :
         {Listing{8, "a", 1, "p"}, Listing{7, "b", 1, "p"}, Listing{7, "", 1, "p"}, Listing{7, "a", 2, "p"},
          Listing{7, "a", 1, "q"}, Listing{7, "a", 1, "p", ShapeOrder::kKey},
          Listing{7, "a", 1, "p", ShapeOrder::kId, true}}) {
        const auto decoded = decodeCursor(other, cursor);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kMalformedCursor);
    }
}

// Text moved from one field to the next gives another listing.
TEST(Cursor, DistinguishesListingsWithSimilarFields) {
    EXPECT_NE(encodeCursor({1, "2 x", 0}, place(5)), encodeCursor({1, "x", 2}, place(5)));
    EXPECT_FALSE(decodeCursor({1, "1 x", 0}, encodeCursor({1, "x", 0}, place(5))));
    EXPECT_FALSE(decodeCursor({1, "ab", 0, "c"}, encodeCursor({1, "a", 0, "bc"}, place(5))));
}

TEST(Cursor, DetectsDamage) {
    const Listing listing{7, "a", 1, "p", ShapeOrder::kKey};
    const std::string cursor = encodeCursor(listing, place(42, 0, "pq"));
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
