// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/backup/backup_chain.h"

#include <filesystem>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "client/api/client.h"
#include "core/base/return_if_error.h"
#include "tests/client/backup/backup_files.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::client {
namespace {

namespace fs = std::filesystem;
using testing::database;
using testing::headBetween;
using testing::incrementBetween;
using testing::readBytes;
using testing::withBlocks;
using testing::writeBytes;

class BackupChainTest : public ::testing::Test {
  protected:
    std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
    std::string write(const std::string& name, const std::string& bytes) const {
        return writeBytes(path(name), bytes);
    }
    /// The backup that the files lead to.
    Result<std::string> merged(const std::vector<std::string>& files) const {
        const auto report = mergeBackups(files, path("merged"));
        EXPECT_FALSE(fs::exists(path("merged.part")));
        if (!report) {
            EXPECT_FALSE(fs::exists(path("merged"))) << "nothing is left of a merge that failed";
            return fail(report.error());
        }
        const std::string bytes = readBytes(path("merged"));
        fs::remove(path("merged"));
        EXPECT_EQ(report->bytes, bytes.size());
        const Sha256Digest digest = sha256(bytes.data(), bytes.size());
        EXPECT_EQ(report->sha256, std::string(digest.begin(), digest.end()));
        return bytes;
    }
    /// The same without writing it.
    static Result<void> readThrough(const std::vector<std::string>& files) {
        auto chain = BackupChain::open(files, {});
        RETURN_IF_ERROR(chain);
        std::string buffer(chain->bytes() + 1, '\0');
        const auto count = chain->read(buffer.data(), buffer.size());
        RETURN_IF_ERROR(count);
        return {};
    }
    void expectRefused(const std::vector<std::string>& files, ErrorCode code,
                       const std::string& words) const {
        const auto result = merged(files);
        ASSERT_FALSE(result) << words;
        EXPECT_EQ(result.error().code, code) << result.error().message;
        EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
    }

    shapedb::testing::TemporaryDirectory folder_;
};

/// What a database may become: pages change, come and go.
std::string changed(std::string file, Random& random) {
    const auto number = [&](std::uint64_t below) { return static_cast<std::size_t>(random.next() % below); };
    const std::size_t pages = file.size() / kBackupPageBytes;
    for (std::size_t i = number(4); i > 0; --i) {
        file[16 + number(file.size() - 16)] ^= static_cast<char>(1 + number(255));
    }
    if (number(3) == 0) file += database(1 + number(9), random.next());
    if (number(4) == 0 && pages > 2) file.resize((2 + number(pages - 2)) * kBackupPageBytes);
    return file;
}

TEST_F(BackupChainTest, ARandomChainGivesWhatTheDatabaseWas) {
    for (std::uint64_t seed = 1; seed <= 15; ++seed) {
        Random random(seed);
        std::string state = database(1 + random.next() % 30, seed);
        std::vector<std::string> files{write("full", state)};
        std::uint64_t blockBytes = kBackupPageBytes;
        for (int i = 0; i < 10; ++i) {
            const std::string before = state;
            state = changed(state, random);
            if (random.next() % 4 == 0) blockBytes *= 2;
            files.push_back(write("inc" + std::to_string(i), incrementBetween(before, state, blockBytes)));
            const auto result = merged(files);
            ASSERT_TRUE(result) << "seed " << seed << ", increment " << i << ": " << result.error().message;
            ASSERT_EQ(*result, state) << "seed " << seed << ", increment " << i;
            const auto manifest = readManifest(files.back(), {});
            ASSERT_TRUE(manifest) << manifest.error().message;
            EXPECT_EQ(manifest->blocks, testing::manifestOf(state, blockBytes).blocks);
        }
    }
}

TEST_F(BackupChainTest, ReadsAnyNumberOfPagesAtATime) {
    const std::string before = database(20, 1);
    std::string after = before;
    for (const std::size_t page : {3, 4, 9, 19}) after[page * kBackupPageBytes + 5] ^= 1;
    const std::vector<std::string> files{write("full", before),
                                         write("inc", incrementBetween(before, after, 8'192))};
    for (const std::size_t pages : {1, 2, 3, 7, 50}) {
        auto chain = BackupChain::open(files, {});
        ASSERT_TRUE(chain) << chain.error().message;
        EXPECT_EQ(chain->bytes(), after.size());
        std::string all;
        std::string buffer(pages * kBackupPageBytes, '\0');
        while (true) {
            const auto count = chain->read(buffer.data(), buffer.size());
            ASSERT_TRUE(count) << count.error().message;
            if (*count == 0) break;
            all.append(buffer, 0, *count);
        }
        EXPECT_EQ(all, after) << pages;
    }
}

TEST_F(BackupChainTest, AFullBackupAloneIsPassedOnAsItIs) {
    auto chain = BackupChain::open({write("any", "whatever it is")}, {});
    ASSERT_TRUE(chain);
    std::string buffer(100, '\0');
    EXPECT_EQ(chain->read(buffer.data(), buffer.size()).value(), 14u);
    EXPECT_EQ(chain->read(buffer.data(), buffer.size()).value(), 0u);
    EXPECT_EQ(buffer.substr(0, 14), "whatever it is");
}

TEST_F(BackupChainTest, WrongOrderAndMissingLinksAreRefusedWithTheReason) {
    const std::string a = database(6, 1);
    const std::string b = a + database(1, 2);
    const std::string c = b + database(1, 3);
    const std::string d = c + database(1, 4);
    const std::string full = write("full.db", a);
    const std::string ab = write("ab.sdbi", incrementBetween(a, b));
    const std::string bc = write("bc.sdbi", incrementBetween(b, c));
    const std::string cd = write("cd.sdbi", incrementBetween(c, d));
    EXPECT_EQ(merged({full, ab, bc, cd}).value(), d);

    const auto wrong = ErrorCode::kInvalidArgument;
    expectRefused({full, ab, cd}, wrong, "the increment between them is missing");
    expectRefused({full, bc, cd}, wrong, "bc.sdbi' does not follow '" + full);
    expectRefused({full, ab, cd, bc}, wrong, "it belongs after '" + bc);
    expectRefused({full, ab, ab}, wrong, "does not follow");
    expectRefused({ab, bc}, wrong, "name the full backup first");
    expectRefused({full}, wrong, "increments to merge");
    expectRefused({}, wrong, "increments to merge");
    expectRefused({full, full}, ErrorCode::kMalformedFile, "is not an increment");
    EXPECT_EQ(BackupChain::open({ab}, {}).error().code, wrong);
    EXPECT_EQ(BackupChain::open({}, {}).error().code, wrong);
    expectRefused({full, path("none")}, ErrorCode::kFileNotReadable, "none");
    expectRefused({full, folder_.path()}, ErrorCode::kFileNotReadable, "is not a file");

    // Another backup of the same size.
    expectRefused({write("other.db", database(6, 9)), ab}, ErrorCode::kChecksumMismatch,
                  "not the backup that");
    // An increment to the result of another history.
    const std::string other = write("other.sdbi", incrementBetween(database(7, 9), c));
    expectRefused({full, ab, other}, wrong, "does not follow");
}

TEST_F(BackupChainTest, TheResultReplacesNoneOfItsFiles) {
    const std::string a = database(3, 1);
    const std::string b = database(4, 2);
    const std::string full = write("full.db", a);
    const std::string increment = write("ab.sdbi", incrementBetween(a, b));
    for (const std::string& file : {full, increment}) {
        EXPECT_EQ(mergeBackups({full, increment}, file).error().code, ErrorCode::kInvalidArgument);
    }
    EXPECT_EQ(readBytes(full), a);
    EXPECT_EQ(mergeBackups({full, increment}, path("no/such/folder")).error().code,
              ErrorCode::kFileNotWritable);
    write("older", "older");
    EXPECT_TRUE(mergeBackups({full, increment}, path("older")));
    EXPECT_EQ(readBytes(path("older")), b);
}

TEST_F(BackupChainTest, EveryFlippedBitIsFound) {
    const std::string a = database(4, 1);
    std::string b = a + database(2, 2);
    b[2 * kBackupPageBytes] ^= 1;
    const std::string full = write("full.db", a);
    const std::string good = incrementBetween(a, b);
    ASSERT_EQ(merged({full, write("inc", good)}).value(), b);
    // Every bit of the fields, one of each byte of the lists, and some of the blocks.
    const std::size_t lists = 8 * kIncrementPrefixBytes;
    const std::size_t blocks = 8 * (good.size() - 3 * kBackupPageBytes);
    for (std::size_t bit = 0; bit < 8 * good.size(); bit += bit < lists ? 1 : bit < blocks ? 9 : 601) {
        std::string bad = good;
        bad[bit / 8] ^= static_cast<char>(1 << (bit % 8));
        const auto read = readThrough({full, write("inc", bad)});
        ASSERT_FALSE(read) << "bit " << bit;
        EXPECT_EQ(read.error().code, ErrorCode::kMalformedFile) << bit << read.error().message;
    }
    for (std::size_t bit = 0; bit < 8 * a.size(); bit += 997) {
        std::string bad = a;
        bad[bit / 8] ^= static_cast<char>(1 << (bit % 8));
        EXPECT_FALSE(readThrough({write("full.db", bad), write("inc", good)})) << "bit " << bit;
    }
}

TEST_F(BackupChainTest, EveryTruncationIsFound) {
    const std::string a = database(4, 1);
    const std::string b = a + database(2, 2);
    const std::string full = write("full.db", a);
    const std::string good = incrementBetween(a, b);
    for (std::size_t size = 0; size < good.size(); size += size < 500 ? 1 : 97) {
        EXPECT_FALSE(readThrough({full, write("inc", good.substr(0, size))})) << size;
    }
    expectRefused({full, write("inc", good + "x")}, ErrorCode::kMalformedFile, "bytes instead of");
}

TEST_F(BackupChainTest, HeadsThatContradictThemselvesAreRefused) {
    const std::string a = database(4, 1);
    const std::string b = a.substr(0, 3 * kBackupPageBytes) + database(3, 2);
    const std::string full = write("full.db", a);
    const auto refused = [&](const IncrementHead& head, const std::string& words) {
        expectRefused({full, write("inc", withBlocks(head, b))}, ErrorCode::kMalformedFile, words);
    };
    const IncrementHead good = headBetween(a, b);
    ASSERT_EQ(good.changed, (std::vector<std::uint32_t>{3, 4, 5}));
    IncrementHead head = good;
    head.changed = {4, 3, 5};
    refused(head, "block");
    head.changed = {3, 4};
    refused(head, "block 5 is missing");
    head.changed = {3, 4, 4, 5};
    refused(head, "is damaged");
    head.changed = {3, 4, 5, 6};
    refused(head, "out of order at block 6");
    head = good;
    head.base.bytes = 4'095;
    refused(head, "whole number of pages");
    head = good;
    head.result.blockBytes = 4'097;
    refused(head, "power of two");
    head = good;
    head.result.backup.bytes = (kMaxBackupBlocks + 1) * kBackupPageBytes;
    refused(head, "more than 65536 blocks");
    // The hash of a block that is not brought is wrong: the blocks are right, the whole is not.
    head = good;
    head.result.backup.sha256[0] ^= 1;
    expectRefused({full, write("inc", withBlocks(head, b))}, ErrorCode::kChecksumMismatch, "do not give");
}

// A manifest of 65,536 blocks is announced by 104 bytes: nothing is allocated before the file is known to be
// as long.
TEST_F(BackupChainTest, SmallFilesThatAnnounceMuchAreRefused) {
    const std::string a = database(1, 1);
    IncrementHead head = headBetween(a, a);
    head.result.backup.bytes = kMaxBackupBlocks * kBackupPageBytes;
    const std::string text = encodeIncrementHead(head).substr(0, kIncrementPrefixBytes);
    expectRefused({write("full", a), write("inc", text)}, ErrorCode::kMalformedFile,
                  "its beginning alone has");
}

TEST_F(BackupChainTest, ManifestsOfOtherFilesAreRefused) {
    EXPECT_EQ(readManifest(write("text", std::string(8'192, 'x')), {}).error().code,
              ErrorCode::kMalformedFile);
    EXPECT_EQ(readManifest(write("cut", database(2, 1).substr(0, 5'000)), {}).error().code,
              ErrorCode::kMalformedFile);
    EXPECT_EQ(readManifest(write("empty", ""), {}).error().code, ErrorCode::kFileNotReadable);
    EXPECT_EQ(readManifest(path("none"), {}).error().code, ErrorCode::kFileNotReadable);
    ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
    EXPECT_EQ(readManifest(path("pipe"), {}).error().code, ErrorCode::kFileNotReadable);
    const auto manifest = readManifest(write("full", database(3, 1)), {});
    ASSERT_TRUE(manifest);
    EXPECT_EQ(manifest->blocks, testing::manifestOf(database(3, 1), kBackupPageBytes).blocks);
}

TEST_F(BackupChainTest, CanBeCancelled) {
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const std::string a = database(3, 1);
    const std::string full = write("full", a);
    EXPECT_EQ(readManifest(full, context).error().code, ErrorCode::kCancelled);
    const std::string increment = write("inc", incrementBetween(a, database(4, 2)));
    EXPECT_EQ(mergeBackups({full, increment}, path("out"), context).error().code, ErrorCode::kCancelled);
    EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(BackupChainTest, MemoryDoesNotGrowWithTheFiles) {
    const std::string full = write("full", database(1, 1));
    constexpr std::uint64_t kBytes = std::uint64_t{128} << 20;
    fs::resize_file(full, kBytes);
    std::string state = database(1, 1);
    state.resize(kBytes);
    state[kBytes / 2] = 'x';
    state += database(1, 2);
    IncrementHead head;
    {
        const auto before = readManifest(full, {});
        ASSERT_TRUE(before);
        ManifestMaker maker(2 * before->blockBytes);
        maker.add(state.data(), state.size());
        head.base = before->backup;
        head.result = maker.finish();
        head.changed = changedBlocks(coarsened(*before, 2 * before->blockBytes), head.result);
    }
    ASSERT_EQ(head.changed.size(), 2u);
    const std::string increment = write("inc", withBlocks(head, state));
    state.clear();
    state.shrink_to_fit();
    // Another process has a peak of its own.
    EXPECT_EXIT(
        {
            rusage before{};
            rusage after{};
            ::getrusage(RUSAGE_SELF, &before);
            const auto report = mergeBackups({full, increment}, path("big"));
            ::getrusage(RUSAGE_SELF, &after);
            ::_exit(report && report->bytes == kBytes + kBackupPageBytes &&
                            after.ru_maxrss - before.ru_maxrss < 32 * 1'024
                        ? 0
                        : 1);
        },
        ::testing::ExitedWithCode(0), "");
    EXPECT_EQ(fs::file_size(path("big")), kBytes + kBackupPageBytes);
}

}  // namespace
}  // namespace shapedb::client
