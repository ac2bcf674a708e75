// SPDX-License-Identifier: Apache-2.0
#include "client/backup/backup_chain.h"

#include <algorithm>
#include <new>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

/// How SQLite files begin.
constexpr char kDatabaseMagic[] = "SQLite format 3";

/// What of an increment says where it belongs.
struct Link {
    std::string path;
    BackupId base;
    BackupId result;
    std::uint64_t blockBytes;
};

/// Enough of a checksum to tell backups apart.
std::string nameOf(const BackupId& id) {
    return toHex(id.sha256).substr(0, 16) + "... (" + std::to_string(id.bytes) + " bytes)";
}

tl::unexpected<Error> withoutMemory() {
    return fail(ErrorCode::kOutOfMemory, "not enough memory for the hashes of a backup");
}

Result<BackupManifest> manifestOfFull(const SourceFile& file, std::uint64_t blockBytes,
                                      const RunContext& context) {
    const auto malformed = [&](const std::string& what) {
        return fail(ErrorCode::kMalformedFile, "'" + file.path() + "' " + what);
    };
    const auto beginning = file.beginning(sizeof kDatabaseMagic);
    RETURN_IF_ERROR(beginning);
    if (looksLikeIncrement(*beginning)) {
        return malformed("is an increment: name the full backup that it belongs to before it");
    }
    if (*beginning != std::string(kDatabaseMagic, sizeof kDatabaseMagic)) {
        return malformed("is neither a backup nor an increment of one");
    }
    if (const auto checked = checkBlocks(file.bytes(), blockBytes); !checked) {
        return malformed("is not a whole backup: " + checked.error().message);
    }
    ManifestMaker maker(blockBytes);
    std::vector<char> buffer(kPieceBytes);
    for (std::uint64_t done = 0; done < file.bytes();) {
        RETURN_IF_ERROR(context.checkpoint());
        const auto size =
            static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), file.bytes() - done));
        RETURN_IF_ERROR(file.read(done, buffer.data(), size));
        maker.add(buffer.data(), size);
        done += size;
        context.report("read", done, file.bytes());
    }
    return maker.finish();
}

tl::unexpected<Error> misplaced(const std::vector<Link>& links, std::size_t i) {
    const Link& link = links[i];
    std::string message = "'" + link.path + "' does not follow '" + links[i - 1].path +
                          "': it continues the backup " + nameOf(link.base) + ", and that one leads to " +
                          nameOf(links[i - 1].result);
    const auto before = std::find_if(links.begin(), links.end(),
                                     [&](const Link& other) { return other.result == link.base; });
    message += before == links.end() ? "; the increment between them is missing"
                                     : "; it belongs after '" + before->path + "'";
    return fail(ErrorCode::kInvalidArgument, message);
}

Result<void> requireOneChain(const std::vector<Link>& links) {
    for (std::size_t i = 1; i < links.size(); ++i) {
        if (!(links[i].base == links[i - 1].result)) return misplaced(links, i);
        // So each block of a later increment covers those of earlier ones entirely.
        if (links[i].blockBytes < links[i - 1].blockBytes) {
            return fail(ErrorCode::kMalformedFile,
                        "'" + links[i].path + "' has smaller blocks than the increment before it");
        }
    }
    return {};
}

Result<void> requireBase(const SourceFile& full, const Link& first, const RunContext& context) {
    if (full.bytes() == first.base.bytes) {
        const auto manifest = manifestOfFull(full, first.blockBytes, context);
        RETURN_IF_ERROR(manifest);
        if (manifest->backup == first.base) return {};
        return fail(ErrorCode::kChecksumMismatch, "'" + full.path() +
                                                      "' is damaged, or not the backup that '" + first.path +
                                                      "' continues: it is " + nameOf(manifest->backup) +
                                                      " instead of " + nameOf(first.base));
    }
    const auto beginning = full.beginning(kIncrementPrefixBytes);
    RETURN_IF_ERROR(beginning);
    return fail(ErrorCode::kInvalidArgument,
                "'" + first.path + "' does not follow '" + full.path() + "': it continues the backup " +
                    nameOf(first.base) + ", and that file " +
                    (looksLikeIncrement(*beginning) ? "is an increment: name the full backup first"
                                                    : "has " + std::to_string(full.bytes()) + " bytes"));
}

}  // namespace

Result<BackupManifest> readManifest(const std::string& path, const RunContext& context) try {
    const auto file = SourceFile::open(path);
    RETURN_IF_ERROR(file);
    const auto beginning = file->beginning(kIncrementPrefixBytes);
    RETURN_IF_ERROR(beginning);
    if (!looksLikeIncrement(*beginning)) {
        return manifestOfFull(*file, backupBlockBytes(file->bytes()), context);
    }
    auto head = readIncrementHead(*file);
    RETURN_IF_ERROR(head);
    return std::move(head->result);
} catch (const std::bad_alloc&) {
    return withoutMemory();
}

Result<BackupChain> BackupChain::open(const std::vector<std::string>& files, const RunContext& context) try {
    if (files.empty()) return fail(ErrorCode::kInvalidArgument, "name the file of a full backup");
    auto full = SourceFile::open(files.front());
    RETURN_IF_ERROR(full);
    std::vector<Link> links;
    BackupChain chain(std::move(*full));
    for (std::size_t i = 1; i < files.size(); ++i) {
        RETURN_IF_ERROR(context.checkpoint());
        auto file = SourceFile::open(files[i]);
        RETURN_IF_ERROR(file);
        const auto head = readIncrementHead(*file);
        RETURN_IF_ERROR(head);
        links.push_back({files[i], head->base, head->result.backup, head->result.blockBytes});
        chain.increments_.emplace_back(std::move(*file), *head);
    }
    if (links.empty()) {
        const auto beginning = chain.full_.beginning(kIncrementPrefixBytes);
        RETURN_IF_ERROR(beginning);
        if (!looksLikeIncrement(*beginning)) return chain;
        return fail(ErrorCode::kInvalidArgument,
                    "'" + files.front() + "' is an increment: name the full backup that it belongs to first");
    }
    RETURN_IF_ERROR(requireOneChain(links));
    RETURN_IF_ERROR(requireBase(chain.full_, links.front(), context));
    chain.bytes_ = links.back().result.bytes;
    chain.wanted_ = links.back().result.sha256;
    return chain;
} catch (const std::bad_alloc&) {
    return withoutMemory();
}

Result<void> BackupChain::readPiece(char* to, std::size_t size, IncrementBlocks* source) {
    RETURN_IF_ERROR(source != nullptr ? source->read(to, size) : full_.read(position_, to, size));
    position_ += size;
    if (increments_.empty()) return {};
    whole_.update(to, size);
    if (position_ == bytes_ && whole_.finish() != wanted_) {
        return fail(ErrorCode::kChecksumMismatch,
                    "the files from '" + full_.path() + "' on do not give the backup that they should");
    }
    return {};
}

Result<std::size_t> BackupChain::read(char* to, std::size_t most) try {
    std::size_t done = 0;
    while (done < most && position_ < bytes_) {
        // The newest increment that brings this place has it; otherwise it is as in the full backup.
        std::uint64_t end = std::min<std::uint64_t>(bytes_, position_ + (most - done));
        IncrementBlocks* source = nullptr;
        for (auto i = increments_.rbegin(); i != increments_.rend() && source == nullptr; ++i) {
            i->skipTo(position_);
            if (i->begin() <= position_) source = &*i;
            end = std::min(end, source != nullptr ? i->end() : i->begin());
        }
        const auto size = static_cast<std::size_t>(end - position_);
        RETURN_IF_ERROR(readPiece(to + done, size, source));
        done += size;
    }
    return done;
} catch (const std::bad_alloc&) {
    return withoutMemory();
}

}  // namespace shapedb::client
