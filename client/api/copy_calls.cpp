// SPDX-License-Identifier: Apache-2.0
// The part of AdminService that moves files: backup and restore of everything, export and import of one
// collection.
#include <filesystem>
#include <system_error>

#include "client/api/call.h"
#include "client/api/client.h"
#include "client/backup/backup_chain.h"
#include "client/backup/backup_file.h"
#include "client/backup/increment_file.h"
#include "common/backup_manifest.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kBackupChunkBytes = std::size_t{1} << 20;

std::string asBytes(const Sha256Digest& digest) { return {digest.begin(), digest.end()}; }

/// What is asked for.
struct Wanted {
    const char* name;  ///< the stage of progress and part of messages: "backup"
    bool increment = false;
};

template <typename Stream>
Result<BackupReport> receiveBackup(Stream& stream, BackupFile& file, const Wanted& wanted,
                                   const RunContext& context) {
    const std::string what = wanted.name;
    RETURN_IF_ERROR(file.open());
    BackupReport report;
    Sha256 checksum;
    std::uint64_t announced = 0;
    std::string expected;
    v1::BackupChunk chunk;
    while (stream.Read(&chunk)) {
        if (chunk.total_bytes() != 0) announced = chunk.total_bytes();
        if (!chunk.sha256().empty()) expected = chunk.sha256();
        const std::string& data = chunk.data();
        if (wanted.increment && report.bytes == 0 && !data.empty() && !looksLikeIncrement(data)) {
            return fail(ErrorCode::kRejected,
                        "the server does not know increments and sent a full backup: update it; nothing was "
                        "kept");
        }
        checksum.update(data.data(), data.size());
        RETURN_IF_ERROR(file.write(data.data(), data.size()));
        report.bytes += data.size();
        context.report(wanted.name, report.bytes, announced);
    }
    report.sha256 = asBytes(checksum.finish());
    if (expected.empty() || report.bytes != announced) {
        return fail(ErrorCode::kCountMismatch, "the " + what + " ended after " +
                                                   std::to_string(report.bytes) + " of " +
                                                   std::to_string(announced) + " bytes; nothing was kept");
    }
    if (expected != report.sha256) {
        return fail(ErrorCode::kChecksumMismatch,
                    "the " + what + " was damaged in transfer; nothing was kept");
    }
    return report;
}

/// Calls an rpc that answers with chunks (`start` makes its stream) and writes them to `file`, which the
/// caller commits.
template <typename Start>
Result<BackupReport> receiveToFile(const ClientOptions& options, BackupFile& file, const Wanted& wanted,
                                   const RunContext& context, const google::protobuf::Message& request,
                                   Start&& start) {
    Result<BackupReport> report;
    const auto made = makeCall(options, context, kIdempotentUnbounded, &request,
                               [&](grpc::ClientContext& rpc, Result<void>& local) {
                                   const auto stream = start(rpc);
                                   report = receiveBackup(*stream, file, wanted, context);
                                   // Only a full disk here, or the wrong answer, ends the call from this
                                   // side; a short stream has its reason in the status.
                                   if (!report && (report.error().code == ErrorCode::kFileNotWritable ||
                                                   report.error().code == ErrorCode::kRejected)) {
                                       local = fail(report.error());
                                       rpc.TryCancel();
                                   }
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    return report;
}

v1::BackupRequest requestSince(const BackupManifest& manifest) {
    v1::BackupRequest request;
    v1::BackupManifest& since = *request.mutable_since();
    since.set_bytes(manifest.backup.bytes);
    since.set_sha256(asBytes(manifest.backup.sha256));
    since.set_block_bytes(manifest.blockBytes);
    std::string& hashes = *since.mutable_block_hashes();
    hashes.reserve(manifest.blocks.size() * sizeof(Sha256Digest));
    for (const Sha256Digest& hash : manifest.blocks) hashes.append(hash.begin(), hash.end());
    return request;
}

/// An increment that others may build on is not replaced, least of all by one that builds on it.
Result<void> requireNoFile(const std::string& path) {
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) return {};
    return fail(ErrorCode::kAlreadyExists,
                "'" + path + "' exists, and an increment replaces no file: choose a new name");
}

/// What was received must fit what was asked for.
Result<IncrementReport> reportOf(BackupFile& file, const BackupReport& received, const BackupId& base) {
    RETURN_IF_ERROR(file.flush());
    const auto written = SourceFile::open(file.partPath());
    RETURN_IF_ERROR(written);
    const auto head = readIncrementHead(*written);
    RETURN_IF_ERROR(head);
    if (!(head->base == base)) {
        return fail(ErrorCode::kInternal, "the server sent an increment to another backup; nothing was kept");
    }
    IncrementReport report;
    report.bytes = received.bytes;
    report.changedBytes = changedBytes(*head);
    report.backup = {head->result.backup.bytes, asBytes(head->result.backup.sha256)};
    return report;
}

/// The size goes with the first chunk, the checksum with the last. `write(chunk)` returns false when the call
/// is over, whose status says why.
template <typename Write>
Result<void> sendChunks(BackupChain& chain, const char* stage, const RunContext& context, Write&& write) {
    Sha256 checksum;
    std::string buffer(kBackupChunkBytes, '\0');
    std::uint64_t sent = 0;
    while (sent < chain.bytes()) {
        const auto count = chain.read(buffer.data(), buffer.size());
        RETURN_IF_ERROR(count);
        checksum.update(buffer.data(), *count);
        v1::BackupChunk chunk;
        if (sent == 0) chunk.set_total_bytes(chain.bytes());
        chunk.set_data(buffer.data(), *count);
        sent += *count;
        if (sent == chain.bytes()) chunk.set_sha256(asBytes(checksum.finish()));
        if (!write(std::move(chunk))) return {};
        context.report(stage, sent, chain.bytes());
    }
    return {};
}

enum class HandedOn { kAll, kBackupEnded, kRestoreEnded };

/// Sends the chunks of a backup, of which `chunk` is the first, to a restore, until all are there or one of
/// the two ends early.
HandedOn handOn(grpc::ClientReader<v1::BackupChunk>& backup, grpc::ClientWriter<v1::BackupChunk>& restore,
                v1::BackupChunk chunk, const RunContext& context) {
    const std::uint64_t total = chunk.total_bytes();
    std::uint64_t sent = 0;
    do {
        if (!restore.Write(chunk)) return HandedOn::kRestoreEnded;
        sent += chunk.data().size();
        context.report("copy", sent, total);
        if (!chunk.sha256().empty()) return HandedOn::kAll;
    } while (backup.Read(&chunk));
    return HandedOn::kBackupEnded;
}

/// An upload that failed on this side must not look complete.
template <typename Stream>
grpc::Status finishUpload(Stream& stream, grpc::ClientContext& rpc, const Result<void>& local) {
    if (local) {
        stream.WritesDone();
    } else {
        rpc.TryCancel();
    }
    return stream.Finish();
}

}  // namespace

Result<BackupReport> Client::backupToFile(const std::string& path, const RunContext& context) const {
    BackupFile file(path);
    const v1::BackupRequest request;
    const auto report =
        receiveToFile(impl_->options, file, {"backup"}, context, request,
                      [&](grpc::ClientContext& rpc) { return impl_->admin->Backup(&rpc, request); });
    RETURN_IF_ERROR(report);
    RETURN_IF_ERROR(file.commit());
    return report;
}

Result<IncrementReport> Client::incrementToFile(const std::string& path, const std::string& since,
                                                const RunContext& context) const {
    RETURN_IF_ERROR(requireNoFile(path));
    const auto manifest = readManifest(since, context);
    RETURN_IF_ERROR(manifest);
    BackupFile file(path);
    const v1::BackupRequest request = requestSince(*manifest);
    const auto received =
        receiveToFile(impl_->options, file, {"increment", true}, context, request,
                      [&](grpc::ClientContext& rpc) { return impl_->admin->Backup(&rpc, request); });
    RETURN_IF_ERROR(received);
    auto report = reportOf(file, *received, manifest->backup);
    RETURN_IF_ERROR(report);
    RETURN_IF_ERROR(file.commit());
    return report;
}

Result<BackupReport> Client::exportCollection(const std::string& collection, const std::string& path,
                                              const RunContext& context) const {
    v1::ExportCollectionRequest request;
    request.set_collection(collection);
    BackupFile file(path);
    const auto report = receiveToFile(
        impl_->options, file, {"export"}, context, request,
        [&](grpc::ClientContext& rpc) { return impl_->admin->ExportCollection(&rpc, request); });
    RETURN_IF_ERROR(report);
    RETURN_IF_ERROR(file.commit());
    return report;
}

Result<RestoreReport> Client::restoreFromFile(const std::string& path, const RunContext& context) const {
    return restoreFromFiles({path}, context);
}

Result<RestoreReport> Client::restoreFromFiles(const std::vector<std::string>& files,
                                               const RunContext& context) const {
    auto chain = BackupChain::open(files, context);
    RETURN_IF_ERROR(chain);
    v1::RestoreResponse response;
    const auto made = makeCall(
        impl_->options, context, kOnceUnbounded, nullptr, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = impl_->admin->Restore(&rpc, &response);
            local = sendChunks(*chain, "restore", context,
                               [&](const v1::BackupChunk& chunk) { return stream->Write(chunk); });
            return finishUpload(*stream, rpc, local);
        });
    RETURN_IF_ERROR(made);
    return RestoreReport{response.collections(), response.shapes()};
}

Result<RestoreReport> Client::copyEverything(const Client& to, const RunContext& context) const {
    v1::RestoreResponse response;
    HandedOn handedOn = HandedOn::kBackupEnded;
    const auto restoreFrom = [&](grpc::ClientReader<v1::BackupChunk>& backup, const v1::BackupChunk& first) {
        return makeCall(to.impl_->options, context, kOnceUnbounded, nullptr,
                        [&](grpc::ClientContext& rpc, Result<void>&) {
                            const auto restore = to.impl_->admin->Restore(&rpc, &response);
                            handedOn = handOn(backup, *restore, first, context);
                            if (handedOn == HandedOn::kAll) {
                                restore->WritesDone();
                            } else {
                                rpc.TryCancel();
                            }
                            return restore->Finish();
                        });
    };
    const v1::BackupRequest request;
    const auto made =
        makeCall(impl_->options, context, kOnceUnbounded, &request,
                 [&](grpc::ClientContext& rpc, Result<void>& local) {
                     const auto backup = impl_->admin->Backup(&rpc, request);
                     v1::BackupChunk chunk;
                     // Only now: to begin may take long, and a restore that brings nothing would be given up.
                     const bool begun = backup->Read(&chunk);
                     const Result<void> restored = begun ? restoreFrom(*backup, chunk) : Result<void>();
                     if (handedOn == HandedOn::kRestoreEnded) rpc.TryCancel();
                     const grpc::Status status = backup->Finish();
                     // A backup that fails has an error of its own, and the restore is cancelled for it.
                     if (handedOn != HandedOn::kBackupEnded) {
                         local = restored;
                     } else if (status.ok()) {
                         local = fail(ErrorCode::kCountMismatch, "the backup ended before it was complete");
                     }
                     return status;
                 });
    RETURN_IF_ERROR(made);
    return RestoreReport{response.collections(), response.shapes()};
}

Result<ImportReport> Client::importCollection(const std::string& path, const std::string& collection,
                                              const RunContext& context) const {
    auto file = BackupChain::open({path}, context);
    RETURN_IF_ERROR(file);
    v1::ImportCollectionRequest header;
    header.mutable_header()->set_collection(collection);
    v1::ImportCollectionResponse response;
    const auto made = makeCall(
        impl_->options, context, kOnceUnbounded, &header, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = impl_->admin->ImportCollection(&rpc, &response);
            if (stream->Write(header)) {
                local = sendChunks(*file, "import", context, [&](v1::BackupChunk chunk) {
                    v1::ImportCollectionRequest request;
                    *request.mutable_chunk() = std::move(chunk);
                    return stream->Write(request);
                });
            }
            return finishUpload(*stream, rpc, local);
        });
    RETURN_IF_ERROR(made);
    return ImportReport{response.collection(), response.shapes(), response.shapes_pending()};
}

}  // namespace shapedb::client
