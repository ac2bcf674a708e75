// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/server/store/transfer_fixture.h"

namespace shapedb::store {
namespace {

using DeadImportTest = TransferTest;

TEST_P(DeadImportTest, AStartRemovesWhatADeadProcessWasImporting) {
    const std::string path = exported();
    const Collection kept = other_->importCollection(path, as("kept"), {}).value();
    const std::uint64_t points = other_->stats()->pointBytes;
    other_.reset();
    const pid_t child = fork();
    if (child == 0) {
        ImportRequest request = as("copy");
        int asked = 0;
        // After the first transaction with shapes.
        request.acceptShape = [&](const Shape&) -> Result<void> {
            if (++asked == kShapes) ::_exit(0);
            return {};
        };
        static_cast<void>(openOther("other.db")->importCollection(path, request, {}));
        ::_exit(1);
    }
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_EQ(status, 0) << "it died in the middle";
    {
        SqliteConnection left(folder_.file("other.db"), OpenMode::kReadWrite, 0);
        EXPECT_EQ(
            left.integer("SELECT count(*) FROM shape s JOIN collection c ON c.id = s.collection_id WHERE "
                         "c.name = '.import'"),
            64);
    }
    EXPECT_TRUE(std::filesystem::exists(folder_.file("other.db.import"))) << "its copy of the file";
    other_ = openOther("other.db");
    expectNothingOf("copy");
    EXPECT_TRUE(other_->findings().empty());
    EXPECT_EQ(other_->stats()->pointBytes, points);
    EXPECT_EQ(other_->countShapes(kept.id, {}).value(), std::uint64_t{kShapes});
    ASSERT_TRUE(other_->importCollection(path, as("copy"), {}));
}

INSTANTIATE_TEST_SUITE_P(On, DeadImportTest, ::testing::Values(Engine::kSqlite));

}  // namespace
}  // namespace shapedb::store
