// SPDX-License-Identifier: Apache-2.0
// Makes a full backup of a chain, without a server.
#include <filesystem>
#include <new>
#include <system_error>

#include "client/api/client.h"
#include "client/backup/backup_chain.h"
#include "client/backup/backup_file.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kMergeBytes = std::size_t{1} << 20;

Result<BackupReport> mergeUnguarded(const std::vector<std::string>& files, const std::string& path,
                                    const RunContext& context) {
    if (files.size() < 2) {
        return fail(ErrorCode::kInvalidArgument, "name a full backup and the increments to merge with it");
    }
    for (const std::string& file : files) {
        std::error_code unknown;
        if (!std::filesystem::equivalent(file, path, unknown)) continue;
        return fail(ErrorCode::kInvalidArgument,
                    "'" + path + "' is one of the backups to merge: choose another name for the result");
    }
    auto chain = BackupChain::open(files, context);
    RETURN_IF_ERROR(chain);
    BackupFile merged(path);
    RETURN_IF_ERROR(merged.open());
    std::string buffer(kMergeBytes, '\0');
    Sha256 checksum;
    BackupReport report;
    while (report.bytes < chain->bytes()) {
        RETURN_IF_ERROR(context.checkpoint());
        const auto count = chain->read(buffer.data(), buffer.size());
        RETURN_IF_ERROR(count);
        checksum.update(buffer.data(), *count);
        RETURN_IF_ERROR(merged.write(buffer.data(), *count));
        report.bytes += *count;
        context.report("merge", report.bytes, chain->bytes());
    }
    RETURN_IF_ERROR(merged.commit());
    const Sha256Digest digest = checksum.finish();
    report.sha256.assign(digest.begin(), digest.end());
    return report;
}

}  // namespace

Result<BackupReport> mergeBackups(const std::vector<std::string>& files, const std::string& path,
                                  const RunContext& context) {
    try {
        return mergeUnguarded(files, path, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to merge the backups");
    }
}

}  // namespace shapedb::client
