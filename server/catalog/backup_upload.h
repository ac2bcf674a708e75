// SPDX-License-Identifier: GPL-3.0-or-later
// The rules for uploading a backup, whatever the transport; the transport keeps the bytes.
#pragma once

#include <cstdint>
#include <string>

#include "common/sha256.h"
#include "core/base/error.h"

namespace shapedb::catalog {

/// One message of an upload. The first says the size of the whole, the last brings the checksum, with or
/// without data. The texts are not owned.
struct BackupPart {
    std::uint64_t totalBytes = 0;  ///< 0 in all but the first
    const std::string& data;
    const std::string& sha256;  ///< empty in all but the last
};

/// Checks the parts of a backup in the order they arrive. One per upload; not thread-safe. After an error
/// only destruction.
class BackupUpload {
  public:
    /// Errors: kMalformedStream (no size in the first message, or a size in a later one; a message after
    /// the checksum; a chunk over kMaxChunkBytes; an empty message), kCountMismatch (more than announced),
    /// kInvalidArgument (checksum not 32 bytes).
    [[nodiscard]] Result<void> add(const BackupPart& part);

    /// The stream has ended. Errors: kMalformedStream (no message or no checksum came), kCountMismatch
    /// (less than announced), kChecksumMismatch.
    [[nodiscard]] Result<void> finish();

    [[nodiscard]] std::uint64_t bytes() const { return received_; }

  private:
    Result<void> check(const BackupPart& part) const;

    bool first_ = true;
    std::uint64_t announced_ = 0;
    std::uint64_t received_ = 0;
    std::string wantedChecksum_;
    Sha256 hash_;
};

}  // namespace shapedb::catalog
