// SPDX-License-Identifier: GPL-3.0-or-later
// What a server that is killed leaves beside its database on PostgreSQL goes at its next start.
#include <filesystem>

#include "server/files/data_directory.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class PostgresTemporaryFilesTest : public StoreTest {
  protected:
    Engine engine() const override { return Engine::kPostgres; }
    void SetUp() override {
        StoreTest::SetUp();
        if (store_ == nullptr) return;
        store_.reset();
        ASSERT_TRUE(files::prepareTemporaryDirectory(temporary_));
        PostgresOptions options = postgresOptions(database_);
        options.temporaryFolder = temporary_;
        store_ = openPostgresStore(options).value();
        const Collection c = collection();
        put(c.id, "cup", 1);
        ASSERT_TRUE(store_->backup(backup_, {}));
        ASSERT_TRUE(store_->exportCollection(c.id, export_, {}));
    }

    /// Keeps what is in the folder in the middle of `work`, and looks what a start makes of it.
    void expectNothingLeft(const std::function<Result<void>(const RunContext&)>& work) {
        namespace fs = std::filesystem;
        const std::string kept = folder_.file("kept");
        fs::remove_all(kept);
        RunContext context;
        context.progress = [&](const char*, std::uint64_t, std::uint64_t) {
            if (fs::exists(kept) || fs::is_empty(temporary_)) return;
            fs::copy(temporary_, kept, fs::copy_options::recursive);
        };
        const auto done = work(context);
        ASSERT_TRUE(done) << done.error().message;
        EXPECT_TRUE(fs::is_empty(temporary_)) << "who is not killed tidies up";
        ASSERT_TRUE(fs::exists(kept)) << "there was no file";
        ASSERT_TRUE(files::prepareTemporaryDirectory(kept));
        EXPECT_TRUE(fs::is_empty(kept));
    }

    const std::string temporary_ = folder_.file("tmp");
    const std::string backup_ = folder_.file("backup.db");
    const std::string export_ = folder_.file("export.db");
};

TEST_F(PostgresTemporaryFilesTest, OfAServerThatIsKilledGoAtItsNextStart) {
    expectNothingLeft([&](const RunContext& context) -> Result<void> {
        const auto problems = store_->check(context);
        return problems ? Result<void>() : fail(problems.error());
    });
    expectNothingLeft([&](const RunContext& context) { return store_->restore(backup_, context, {}); });
    expectNothingLeft([&](const RunContext& context) -> Result<void> {
        ImportRequest another;
        another.name = "copy";
        const auto imported = store_->importCollection(export_, another, context);
        return imported ? Result<void>() : fail(imported.error());
    });
}

}  // namespace
}  // namespace shapedb::store
