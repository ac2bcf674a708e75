// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/backup_upload.h"

#include <cstring>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {

Result<void> BackupUpload::check(const BackupPart& part) const {
    const auto malformed = [&](const std::string& what) {
        return fail(ErrorCode::kMalformedStream,
                    "backup after " + std::to_string(received_) + " bytes: " + what);
    };
    if (!wantedChecksum_.empty()) return malformed("message after the checksum, which comes last");
    if (first_ != (part.totalBytes > 0)) {
        return malformed(first_ ? "the first message must say total_bytes"
                                : "total_bytes comes only in the first message");
    }
    if (part.data.empty() && part.sha256.empty()) return malformed("empty message");
    if (part.data.size() > kMaxChunkBytes) {
        return malformed("chunk of " + std::to_string(part.data.size()) + " bytes, at most " +
                         std::to_string(kMaxChunkBytes) + " are allowed");
    }
    const std::uint64_t announced = first_ ? part.totalBytes : announced_;
    if (received_ + part.data.size() > announced) {
        return fail(ErrorCode::kCountMismatch,
                    "received more bytes than the " + std::to_string(announced) + " announced");
    }
    if (!part.sha256.empty() && part.sha256.size() != Sha256Digest().size()) {
        return fail(ErrorCode::kInvalidArgument,
                    "sha256: " + std::to_string(part.sha256.size()) + " bytes, must be 32");
    }
    return {};
}

Result<void> BackupUpload::add(const BackupPart& part) {
    RETURN_IF_ERROR(check(part));
    if (first_) announced_ = part.totalBytes;
    first_ = false;
    wantedChecksum_ = part.sha256;
    hash_.update(part.data.data(), part.data.size());
    received_ += part.data.size();
    return {};
}

Result<void> BackupUpload::finish() {
    if (first_) return fail(ErrorCode::kMalformedStream, "the stream ended before the first message");
    if (received_ != announced_) {
        return fail(ErrorCode::kCountMismatch, std::to_string(received_) + " bytes received, " +
                                                   std::to_string(announced_) + " were announced");
    }
    if (wantedChecksum_.empty())
        return fail(ErrorCode::kMalformedStream, "the stream ended without a checksum");
    const Sha256Digest digest = hash_.finish();
    if (std::memcmp(wantedChecksum_.data(), digest.data(), digest.size()) != 0) {
        return fail(ErrorCode::kChecksumMismatch, "the backup received has the SHA-256 " + toHex(digest) +
                                                      ", which is not the one sent with it: send it again");
    }
    return {};
}

}  // namespace shapedb::catalog
