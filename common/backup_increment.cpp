// SPDX-License-Identifier: Apache-2.0
#include "common/backup_increment.h"

#include <algorithm>
#include <cstring>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr char kMagic[] = "ShDBincr";
constexpr std::size_t kMagicBytes = sizeof kMagic - 1;
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHashBytes = sizeof(Sha256Digest);

void putNumber(std::string& to, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}

void putHash(std::string& to, const Sha256Digest& hash) { to.append(hash.begin(), hash.end()); }

void putId(std::string& to, const BackupId& id) {
    putNumber(to, id.bytes, 8);
    putHash(to, id.sha256);
}

/// Takes a text apart that is known to be long enough.
class Fields {
  public:
    Fields(const std::string& text, std::size_t at) : at_(text.data() + at) {}

    std::uint64_t number(int bytes) {
        std::uint64_t value = 0;
        for (int i = 0; i < bytes; ++i) {
            value |= static_cast<std::uint64_t>(static_cast<unsigned char>(*at_++)) << (8 * i);
        }
        return value;
    }
    Sha256Digest hash() {
        Sha256Digest hash;
        std::memcpy(hash.data(), at_, kHashBytes);
        at_ += kHashBytes;
        return hash;
    }
    BackupId id() {
        BackupId id;
        id.bytes = number(8);
        id.sha256 = hash();
        return id;
    }

  private:
    const char* at_;
};

tl::unexpected<Error> malformed(const std::string& what) { return fail(ErrorCode::kMalformedFile, what); }

/// The fields before the lists.
struct Prefix {
    std::uint64_t changed = 0;
    IncrementHead head;  ///< without its lists
    std::uint64_t blocks = 0;

    [[nodiscard]] std::uint64_t headBytes() const {
        return kIncrementPrefixBytes + blocks * kHashBytes + changed * 4 + kHashBytes;
    }
};

Result<Prefix> readPrefix(const std::string& text) {
    if (!looksLikeIncrement(text)) return malformed("is not an increment of a backup");
    if (text.size() < kIncrementPrefixBytes) {
        return malformed("ends after " + std::to_string(text.size()) + " bytes");
    }
    Fields fields(text, kMagicBytes);
    const auto version = fields.number(4);
    if (version != kVersion) {
        return malformed("is an increment of version " + std::to_string(version) + ", this program reads " +
                         std::to_string(kVersion) + ": update it");
    }
    Prefix prefix;
    prefix.changed = fields.number(4);
    prefix.head.base = fields.id();
    BackupManifest& result = prefix.head.result;
    result.backup = fields.id();
    result.blockBytes = fields.number(8);
    for (const std::uint64_t bytes : {prefix.head.base.bytes, result.backup.bytes}) {
        if (const auto checked = checkBlocks(bytes, result.blockBytes); !checked) {
            return malformed("is damaged: " + checked.error().message);
        }
    }
    prefix.blocks = countBlocks(result.backup.bytes, result.blockBytes);
    if (prefix.changed > prefix.blocks) return malformed("is damaged: brings more blocks than there are");
    return prefix;
}

/// Ascending, within the result, and with all whose size is another than in the base.
Result<void> checkChanged(const IncrementHead& head) {
    const std::uint64_t blockBytes = head.result.blockBytes;
    const std::uint64_t blocks = head.result.blocks.size();
    auto next = head.changed.begin();
    for (std::uint64_t block = 0; block < blocks; ++block) {
        const bool brought = next != head.changed.end() && *next == block;
        if (brought) ++next;
        if (!brought && bytesOfBlock(head.base.bytes, blockBytes, block) !=
                            bytesOfBlock(head.result.backup.bytes, blockBytes, block)) {
            return malformed("is damaged: block " + std::to_string(block) + " is missing");
        }
    }
    if (next == head.changed.end()) return {};
    return malformed("is damaged: its list of blocks is out of order at block " + std::to_string(*next));
}

}  // namespace

bool looksLikeIncrement(const std::string& beginning) {
    return beginning.compare(0, kMagicBytes, kMagic) == 0;
}

std::string encodeIncrementHead(const IncrementHead& head) {
    std::string text(kMagic);
    putNumber(text, kVersion, 4);
    putNumber(text, head.changed.size(), 4);
    putId(text, head.base);
    putId(text, head.result.backup);
    putNumber(text, head.result.blockBytes, 8);
    for (const Sha256Digest& hash : head.result.blocks) putHash(text, hash);
    for (const std::uint32_t block : head.changed) putNumber(text, block, 4);
    putHash(text, sha256(text.data(), text.size()));
    return text;
}

std::uint64_t changedBytes(const IncrementHead& head) {
    std::uint64_t bytes = 0;
    for (const std::uint32_t block : head.changed) {
        bytes += bytesOfBlock(head.result.backup.bytes, head.result.blockBytes, block);
    }
    return bytes;
}

Result<std::size_t> incrementHeadBytes(const std::string& prefix, std::uint64_t fileBytes) {
    const auto read = readPrefix(prefix);
    RETURN_IF_ERROR(read);
    if (read->headBytes() > fileBytes) {
        return malformed("ends after " + std::to_string(fileBytes) + " bytes, its beginning alone has " +
                         std::to_string(read->headBytes()));
    }
    return static_cast<std::size_t>(read->headBytes());
}

Result<IncrementHead> decodeIncrementHead(const std::string& head, std::uint64_t fileBytes) {
    auto prefix = readPrefix(head);
    RETURN_IF_ERROR(prefix);
    if (head.size() != prefix->headBytes()) {
        return malformed("ends after " + std::to_string(head.size()) + " bytes");
    }
    IncrementHead result = std::move(prefix->head);
    Fields fields(head, kIncrementPrefixBytes);
    for (std::uint64_t i = 0; i < prefix->blocks; ++i) result.result.blocks.push_back(fields.hash());
    for (std::uint64_t i = 0; i < prefix->changed; ++i) {
        result.changed.push_back(static_cast<std::uint32_t>(fields.number(4)));
    }
    if (fields.hash() != sha256(head.data(), head.size() - kHashBytes))
        return malformed("is damaged: wrong checksum");
    RETURN_IF_ERROR(checkChanged(result));
    const std::uint64_t whole = head.size() + changedBytes(result);
    if (whole != fileBytes) {
        return malformed("has " + std::to_string(fileBytes) + " bytes instead of " + std::to_string(whole));
    }
    return result;
}

}  // namespace shapedb
