// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/data_directory.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/files/temporary_file.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::files {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryDirectory;

void write(const std::string& path) { std::ofstream(path) << "precious"; }

TEST(DataDirectory, IsCreatedPrivateWithItsParents) {
    const TemporaryDirectory directory;
    const std::string path = directory.file("a/b");
    ASSERT_TRUE(prepareDataDirectory(path));
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all);
    ASSERT_TRUE(prepareDataDirectory(path)) << "an empty one is taken again";
}

TEST(DataDirectory, ForeignFilesAreRefusedAndLeftAlone) {
    const TemporaryDirectory directory;
    fs::create_directories(directory.file("tmp/of-others"));
    const auto prepared = prepareDataDirectory(directory.path());
    ASSERT_FALSE(prepared);
    EXPECT_EQ(prepared.error().code, ErrorCode::kFileNotWritable);
    EXPECT_NE(prepared.error().message.find("'tmp' but no ShapeDB database"), std::string::npos)
        << prepared.error().message;
    EXPECT_TRUE(fs::exists(directory.file("tmp/of-others")));
}

TEST(DataDirectory, WithADatabaseMayHoldOtherFiles) {
    for (const char* name : {"shapedb.sqlite", "shapedb.sqlite-wal", "shapedb.sqlite.new"}) {
        const TemporaryDirectory directory;
        write(directory.file("notes.txt"));
        write(directory.file(name));
        EXPECT_TRUE(prepareDataDirectory(directory.path())) << name;
    }
}

TEST(DataDirectory, MayBeTheRootOfAFileSystem) {
    const TemporaryDirectory directory;
    fs::create_directory(directory.file("lost+found"));
    EXPECT_TRUE(prepareDataDirectory(directory.path()));
}

TEST(DataDirectory, MayBeNamedByALink) {
    const TemporaryDirectory directory;
    fs::create_directory(directory.file("volume"));
    fs::create_directory_symlink(directory.file("volume"), directory.file("link"));
    EXPECT_TRUE(prepareDataDirectory(directory.file("link")));
    write(directory.file("file"));
    EXPECT_FALSE(prepareDataDirectory(directory.file("file")));
    EXPECT_FALSE(prepareDataDirectory("/proc/none/at/all"));
}

TEST(TemporaryDirectory, LosesTheFilesOfADeadProcess) {
    const TemporaryDirectory parent;
    const std::string path = parent.file("tmp");
    ASSERT_TRUE(prepareTemporaryDirectory(path));
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all);
    fs::create_directory(path + "/shapedb-AbCdEf");
    write(path + "/shapedb-AbCdEf/database");
    write(path + "/shapedb-AbCdEf/database-wal");
    ASSERT_TRUE(prepareTemporaryDirectory(path));
    EXPECT_TRUE(fs::is_empty(path));
}

TEST(TemporaryDirectory, KeepsWhatIsNotOurs) {
    const TemporaryDirectory parent;
    const std::string path = parent.file("tmp");
    fs::create_directories(path + "/photos/summer");
    write(path + "/letter.txt");
    fs::create_directories(path + "/shapedb-AbCdEf/photos");
    write(path + "/shapedb-AbCdEf/photos/database");
    write(path + "/shapedb-AbCdEf/letter.txt");
    ASSERT_TRUE(prepareTemporaryDirectory(path));
    for (const char* name :
         {"/photos/summer", "/letter.txt", "/shapedb-AbCdEf/photos/database", "/shapedb-AbCdEf/letter.txt"}) {
        EXPECT_TRUE(fs::exists(path + name)) << name;
    }
}

TEST(TemporaryDirectory, LinksAreNeverFollowed) {
    const TemporaryDirectory parent;
    const std::string precious = parent.file("precious");
    fs::create_directories(precious + "/shapedb-AbCdEf");
    write(precious + "/shapedb-AbCdEf/database");
    write(precious + "/database");

    // The directory itself.
    fs::create_directory_symlink(precious, parent.file("tmp"));
    const auto prepared = prepareTemporaryDirectory(parent.file("tmp"));
    ASSERT_FALSE(prepared);
    EXPECT_NE(prepared.error().message.find("is a link"), std::string::npos) << prepared.error().message;

    // A folder in it, and a file in such a folder.
    const std::string path = parent.file("real");
    fs::create_directories(path + "/shapedb-000000");
    fs::create_directory_symlink(precious, path + "/shapedb-AbCdEf");
    fs::create_symlink(precious + "/database", path + "/shapedb-000000/database");
    ASSERT_TRUE(prepareTemporaryDirectory(path));
    EXPECT_FALSE(fs::exists(path + "/shapedb-000000")) << "the link itself is ours to remove";
    EXPECT_TRUE(fs::exists(precious + "/database"));
    EXPECT_TRUE(fs::exists(precious + "/shapedb-AbCdEf/database"));
}

TEST(TemporaryDirectory, OfAnotherUserIsRefused) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can give files away";
    const TemporaryDirectory parent;
    const std::string path = parent.file("tmp");
    fs::create_directory(path);
    ASSERT_EQ(::chown(path.c_str(), 65534, 65534), 0);
    EXPECT_FALSE(prepareTemporaryDirectory(path));
    EXPECT_FALSE(prepareTemporaryDirectory("/proc/none/at/all"));
}

TEST(TemporaryFile, IsRemovedWithItsOwner) {
    const TemporaryDirectory directory;
    std::string path;
    {
        auto file = TemporaryFile::create(directory.path());
        ASSERT_TRUE(file);
        path = file->path();
        write(path);
        write(path + "-wal");
        TemporaryFile moved = std::move(*file);
        EXPECT_EQ(moved.path(), path);
        EXPECT_TRUE(fs::exists(path));
    }
    EXPECT_FALSE(fs::exists(path));
    EXPECT_TRUE(fs::is_empty(directory.path()));
    EXPECT_FALSE(TemporaryFile::create(directory.file("none")));
}

}  // namespace
}  // namespace shapedb::files
