// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the reader of increments: whatever the file, it is refused, or the chain gives exactly the backup
// that the increment names. The first byte says how the input is used: as the file; as changes of a good
// increment (place, byte); as the fields of one whose checksums are right.
#include <cstdio>

#include "client/backup/backup_chain.h"
#include "common/backup_increment.h"
#include "tests/client/backup/backup_files.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

struct Files {
    const std::string base = testing::database(6, 1);
    const std::string now = base.substr(0, 2 * kBackupPageBytes) + testing::database(5, 2);
    const std::string full = fuzz::writeFile(".full", base);
};

std::string damagedIncrement(const Files& files, fuzz::Input& input) {
    std::string text = testing::incrementBetween(files.base, files.now, kBackupPageBytes << input.byte() % 3);
    while (input.left() > 0)
        text[input.number<std::uint16_t>() % text.size()] = static_cast<char>(input.byte());
    return text;
}

/// The lists may say anything; the blocks that they name are there if the result has them.
std::string consistentIncrement(const Files& files, fuzz::Input& input) {
    IncrementHead head = testing::headBetween(files.base, files.now);
    const std::uint8_t which = input.byte();
    if (which & 1) head.result.backup.bytes = kBackupPageBytes * input.byte();
    if (which & 2) head.base.bytes = kBackupPageBytes * input.byte();
    if (which & 4) head.result.blockBytes = kBackupPageBytes * input.byte();
    if (which & 8) head.result.blocks.resize(input.byte());
    if (which & 16) head.result.backup.sha256[0] ^= input.byte();
    if (which & 32) {
        head.changed.clear();
        while (input.left() > 0) head.changed.push_back(input.byte() % 16);
    }
    std::string text = encodeIncrementHead(head);
    for (const std::uint32_t block : head.changed) {
        const std::uint64_t at = block * head.result.blockBytes;
        if (at < files.now.size()) text += files.now.substr(at, head.result.blockBytes);
    }
    return text;
}

std::string incrementOf(const Files& files, fuzz::Input& input) {
    switch (input.byte() % 3) {
        case 0: return input.rest();
        case 1: return damagedIncrement(files, input);
        default: return consistentIncrement(files, input);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Files files;
    fuzz::Input input(data, size);
    const std::string path = fuzz::writeFile(".increment", incrementOf(files, input));
    fuzz::valueOrExplained(client::readManifest(path, {}));
    auto opened = client::BackupChain::open({files.full, path}, {});
    if (fuzz::valueOrExplained(opened) == nullptr) return 0;
    require(opened->bytes() <= (std::uint64_t{1} << 32), "no more than the blocks of a small file");
    std::string all;
    std::string buffer(3 * kBackupPageBytes, '\0');
    while (all.size() < opened->bytes()) {
        const auto count = opened->read(buffer.data(), buffer.size());
        if (fuzz::valueOrExplained(count) == nullptr) return 0;
        require(*count > 0, "what is not at its end goes on");
        all.append(buffer, 0, *count);
    }
    require(all == files.now, "only what the checksum names comes of a chain");
    return 0;
}
