// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/connection.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

using SqliteCheckTest = StoreTest;

TEST_F(SqliteCheckTest, SaysThatThereAreMoreProblemsOnlyWhenThereAre) {
    const Collection c = collection();
    for (int i = 0; i < 200; ++i) put(c.id, "k" + std::to_string(i), i);
    // Each pending shape without a job is a problem.
    const auto loseJobs = [&] {
        store_.reset();
        SqliteConnection(options().path, OpenMode::kReadWrite, 0).execute("DELETE FROM job");
        open();
    };
    loseJobs();
    const auto all = store_->check({}).value();
    EXPECT_EQ(all.size(), 200u);
    EXPECT_NE(all.back().find("is pending but has no job"), std::string::npos) << all.back();
    put(c.id, "one more", 200);
    loseJobs();
    const auto some = store_->check({}).value();
    ASSERT_EQ(some.size(), 201u);
    EXPECT_EQ(some.back(), "... and more");
    EXPECT_NE(some[199].find("is pending but has no job"), std::string::npos) << some[199];
}

}  // namespace
}  // namespace shapedb::store
