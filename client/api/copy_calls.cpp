// The part of AdminService that moves files: backup and restore of everything, export and import of one
// collection.
#include <algorithm>
#include <fstream>

#include "client/api/backup_file.h"
#include "client/api/call.h"
#include "client/api/client.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kBackupChunkBytes = std::size_t{1} << 20;

std::string asBytes(const Sha256Digest& digest) { return {digest.begin(), digest.end()}; }

/// `what` is the stage of progress and part of messages: "backup" or "export".
template <typename Stream>
Result<BackupReport> receiveBackup(Stream& stream, BackupFile& file, const char* what,
                                   const RunContext& context) {
    RETURN_IF_ERROR(file.open());
    BackupReport report;
    Sha256 checksum;
    std::uint64_t announced = 0;
    std::string expected;
    v1::BackupChunk chunk;
    while (stream.Read(&chunk)) {
        if (chunk.total_bytes() != 0) announced = chunk.total_bytes();
        if (!chunk.sha256().empty()) expected = chunk.sha256();
        checksum.update(chunk.data().data(), chunk.data().size());
        RETURN_IF_ERROR(file.write(chunk.data()));
        report.bytes += chunk.data().size();
        context.report(what, report.bytes, announced);
    }
    report.sha256 = asBytes(checksum.finish());
    if (expected.empty() || report.bytes != announced) {
        return fail(ErrorCode::kCountMismatch, std::string("the ") + what + " ended after " +
                                                   std::to_string(report.bytes) + " of " +
                                                   std::to_string(announced) + " bytes; nothing was kept");
    }
    if (expected != report.sha256) {
        return fail(ErrorCode::kChecksumMismatch,
                    std::string("the ") + what + " was damaged in transfer; nothing was kept");
    }
    return report;
}

/// Calls an rpc that answers with chunks (`start` makes its stream) and writes them to `path`.
template <typename Start>
Result<BackupReport> receiveToFile(const ClientOptions& options, const std::string& path, const char* what,
                                   const RunContext& context, Start&& start) {
    BackupFile file(path);
    Result<BackupReport> report;
    const auto made =
        makeCall(options, context, kIdempotentUnbounded, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = start(rpc);
            report = receiveBackup(*stream, file, what, context);
            // Only a full disk here ends the call from this side; a short stream has
            // its reason in the status.
            if (!report && report.error().code == ErrorCode::kFileNotWritable) {
                local = fail(report.error());
                rpc.TryCancel();
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    RETURN_IF_ERROR(report);
    RETURN_IF_ERROR(file.commit());
    return report;
}

/// A file to be sent.
struct OutgoingFile {
    std::ifstream stream;
    std::uint64_t bytes = 0;
    std::string path;

    /// Errors: kFileNotReadable.
    static Result<OutgoingFile> open(const std::string& path) {
        std::ifstream file(path, std::ios::binary | std::ios::ate);
        const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
        if (size < 0) return fail(ErrorCode::kFileNotReadable, path + ": cannot be opened for reading");
        if (size == 0) return fail(ErrorCode::kFileNotReadable, path + ": is empty, not a backup");
        file.seekg(0);
        return OutgoingFile{std::move(file), static_cast<std::uint64_t>(size), path};
    }
};

/// The size goes with the first chunk, the checksum with the last. `write(chunk)` returns false when the call
/// is over, whose status says why.
template <typename Write>
Result<void> sendChunks(OutgoingFile& file, const char* stage, const RunContext& context, Write&& write) {
    Sha256 checksum;
    std::string buffer(kBackupChunkBytes, '\0');
    std::uint64_t sent = 0;
    while (sent < file.bytes) {
        // Never beyond the announced size, even if the file grows meanwhile.
        file.stream.read(buffer.data(), static_cast<std::streamsize>(
                                            std::min<std::uint64_t>(buffer.size(), file.bytes - sent)));
        const auto count = static_cast<std::size_t>(file.stream.gcount());
        if (count == 0) {
            return fail(ErrorCode::kFileNotReadable,
                        file.path + ": cannot be read beyond byte " + std::to_string(sent));
        }
        checksum.update(buffer.data(), count);
        v1::BackupChunk chunk;
        if (sent == 0) chunk.set_total_bytes(file.bytes);
        chunk.set_data(buffer.data(), count);
        sent += count;
        if (sent == file.bytes) chunk.set_sha256(asBytes(checksum.finish()));
        if (!write(std::move(chunk))) return {};
        context.report(stage, sent, file.bytes);
    }
    return {};
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
    return receiveToFile(impl_->options, path, "backup", context, [&](grpc::ClientContext& rpc) {
        return impl_->admin->Backup(&rpc, v1::BackupRequest());
    });
}

Result<BackupReport> Client::exportCollection(const std::string& collection, const std::string& path,
                                              const RunContext& context) const {
    v1::ExportCollectionRequest request;
    request.set_collection(collection);
    return receiveToFile(impl_->options, path, "export", context, [&](grpc::ClientContext& rpc) {
        return impl_->admin->ExportCollection(&rpc, request);
    });
}

Result<RestoreReport> Client::restoreFromFile(const std::string& path, const RunContext& context) const {
    auto file = OutgoingFile::open(path);
    RETURN_IF_ERROR(file);
    v1::RestoreResponse response;
    const auto made =
        makeCall(impl_->options, context, kOnceUnbounded, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = impl_->admin->Restore(&rpc, &response);
            local = sendChunks(*file, "restore", context,
                               [&](const v1::BackupChunk& chunk) { return stream->Write(chunk); });
            return finishUpload(*stream, rpc, local);
        });
    RETURN_IF_ERROR(made);
    return RestoreReport{response.collections(), response.shapes()};
}

Result<ImportReport> Client::importCollection(const std::string& path, const std::string& collection,
                                              const RunContext& context) const {
    auto file = OutgoingFile::open(path);
    RETURN_IF_ERROR(file);
    v1::ImportCollectionResponse response;
    const auto made =
        makeCall(impl_->options, context, kOnceUnbounded, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = impl_->admin->ImportCollection(&rpc, &response);
            v1::ImportCollectionRequest header;
            header.mutable_header()->set_collection(collection);
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
