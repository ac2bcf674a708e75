#include "server/store/quarantine.h"

#include <gtest/gtest.h>

namespace shapedb::store {
namespace {

TEST(Quarantine, TakesScansThatWereTriedAsOftenAsAllowed) {
    EXPECT_FALSE(isQuarantined(1, 2));
    EXPECT_TRUE(isQuarantined(2, 2));
    EXPECT_TRUE(isQuarantined(3, 2)) << "the limit was lowered";
    EXPECT_TRUE(isQuarantined(1, 1));
}

TEST(Quarantine, SaysHowOftenAndWhatToDo) {
    const Error error = quarantineError(2);
    EXPECT_EQ(error.code, ErrorCode::kInternal);
    EXPECT_EQ(error.message,
              "the server stopped 2 times while it segmented this scan; it is quarantined. Replace its "
              "points, or rebuild the collection, to try again");
}

}  // namespace
}  // namespace shapedb::store
