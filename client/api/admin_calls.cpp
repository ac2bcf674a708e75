// AdminService and grpc.health.v1.
#include <algorithm>
#include <fstream>

#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/generic/generic_stub.h>

#include "client/api/backup_file.h"
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kBackupChunkBytes = std::size_t{1} << 20;

std::string asBytes(const Sha256Digest& digest) { return {digest.begin(), digest.end()}; }

template <typename Stream>
Result<BackupReport> receiveBackup(Stream& stream, BackupFile& file, const RunContext& context) {
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
        context.report("backup", report.bytes, announced);
    }
    report.sha256 = asBytes(checksum.finish());
    if (expected.empty() || report.bytes != announced) {
        return fail(ErrorCode::kCountMismatch, "the backup ended after " + std::to_string(report.bytes) +
                                                   " of " + std::to_string(announced) +
                                                   " bytes; nothing was kept");
    }
    if (expected != report.sha256) {
        return fail(ErrorCode::kChecksumMismatch, "the backup was damaged in transfer; nothing was kept");
    }
    return report;
}

/// The size goes with the first chunk, the checksum with the last.
template <typename Stream>
Result<void> sendBackup(Stream& stream, std::ifstream& file, std::uint64_t size, const std::string& path,
                        const RunContext& context) {
    Sha256 checksum;
    std::string buffer(kBackupChunkBytes, '\0');
    std::uint64_t sent = 0;
    while (sent < size) {
        // Never beyond the announced size, even if the file grows meanwhile.
        file.read(buffer.data(),
                  static_cast<std::streamsize>(std::min<std::uint64_t>(buffer.size(), size - sent)));
        const auto count = static_cast<std::size_t>(file.gcount());
        if (count == 0) {
            return fail(ErrorCode::kFileNotReadable,
                        path + ": cannot be read beyond byte " + std::to_string(sent));
        }
        checksum.update(buffer.data(), count);
        v1::BackupChunk chunk;
        if (sent == 0) chunk.set_total_bytes(size);
        chunk.set_data(buffer.data(), count);
        sent += count;
        if (sent == size) chunk.set_sha256(asBytes(checksum.finish()));
        if (!stream.Write(chunk)) return {};  // the status of the call says why
        context.report("restore", sent, size);
    }
    stream.WritesDone();
    return {};
}

// grpc.health.v1 has one field each way: the name of the service in HealthCheckRequest, the status in
// HealthCheckResponse. Written by hand, which spares a generated file.
constexpr std::uint32_t kServiceTag = 0x0a;  // field 1, length-delimited
constexpr std::uint32_t kStatusTag = 0x08;   // field 1, varint

grpc::ByteBuffer encodeHealthRequest(const std::string& service) {
    std::string bytes;
    if (!service.empty()) {
        google::protobuf::io::StringOutputStream stream(&bytes);
        google::protobuf::io::CodedOutputStream coded(&stream);
        coded.WriteTag(kServiceTag);
        coded.WriteVarint32(static_cast<std::uint32_t>(service.size()));
        coded.WriteString(service);
    }
    const grpc::Slice slice(bytes);
    return {&slice, 1};
}

Health decodeHealthResponse(const grpc::ByteBuffer& buffer) {
    grpc::Slice slice;
    if (!buffer.DumpToSingleSlice(&slice).ok()) return Health::kUnknown;
    google::protobuf::io::CodedInputStream coded(slice.begin(), static_cast<int>(slice.size()));
    std::uint32_t status = 0;
    if (coded.ReadTag() != kStatusTag || !coded.ReadVarint32(&status)) return Health::kUnknown;
    switch (status) {
        case 1: return Health::kServing;
        case 2: return Health::kNotServing;
        default: return Health::kUnknown;
    }
}

}  // namespace

Result<std::vector<RebuildProgress>> Client::rebuild(
    const RebuildRequest& rebuild, const std::function<void(const RebuildProgress&)>& onProgress,
    const RunContext& context) const {
    v1::RebuildRequest request;
    request.set_collection(rebuild.collection);
    request.set_cache_only(rebuild.cacheOnly);
    request.set_detach(rebuild.detach);
    fillParameters(rebuild.parameters, &request);
    std::map<std::string, RebuildProgress> last;
    const auto made =
        makeCall(impl_->options, context, kOnceUnbounded, [&](grpc::ClientContext& rpc, Result<void>&) {
            const auto stream = impl_->admin->Rebuild(&rpc, request);
            v1::RebuildProgress message;
            while (stream->Read(&message)) {
                const RebuildProgress progress = fromWire(message);
                last[progress.collection] = progress;
                if (onProgress) onProgress(progress);
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    std::vector<RebuildProgress> results;
    for (auto& [name, progress] : last) results.push_back(std::move(progress));
    return results;
}

Result<void> Client::cancelRebuild(const std::string& collection, const RunContext& context) const {
    v1::CancelRebuildRequest request;
    request.set_collection(collection);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->admin,
                                    &v1::AdminService::Stub::CancelRebuild, request);
    RETURN_IF_ERROR(response);
    return {};
}

Result<BackupReport> Client::backupToFile(const std::string& path, const RunContext& context) const {
    BackupFile file(path);
    Result<BackupReport> report;
    const auto made = makeCall(impl_->options, context, kIdempotentUnbounded,
                               [&](grpc::ClientContext& rpc, Result<void>& local) {
                                   const auto stream = impl_->admin->Backup(&rpc, v1::BackupRequest());
                                   report = receiveBackup(*stream, file, context);
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

Result<RestoreReport> Client::restoreFromFile(const std::string& path, const RunContext& context) const {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
    if (size < 0) return fail(ErrorCode::kFileNotReadable, path + ": cannot be opened for reading");
    if (size == 0) return fail(ErrorCode::kFileNotReadable, path + ": is empty, not a backup");
    file.seekg(0);
    v1::RestoreResponse response;
    const auto made =
        makeCall(impl_->options, context, kOnceUnbounded, [&](grpc::ClientContext& rpc, Result<void>& local) {
            const auto stream = impl_->admin->Restore(&rpc, &response);
            local = sendBackup(*stream, file, static_cast<std::uint64_t>(size), path, context);
            if (!local) rpc.TryCancel();
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    return RestoreReport{response.collections(), response.shapes()};
}

Result<std::vector<std::string>> Client::check(const std::function<void(const CheckProgress&)>& onProgress,
                                               const RunContext& context) const {
    std::vector<std::string> problems;
    const auto made =
        makeCall(impl_->options, context, kIdempotentUnbounded, [&](grpc::ClientContext& rpc, Result<void>&) {
            problems.clear();
            const auto stream = impl_->admin->Check(&rpc, v1::CheckRequest());
            v1::CheckProgress message;
            while (stream->Read(&message)) {
                problems.insert(problems.end(), message.problems().begin(), message.problems().end());
                if (!onProgress) continue;
                onProgress({message.done(),
                            message.total(),
                            {message.problems().begin(), message.problems().end()},
                            message.finished()});
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    return problems;
}

Result<Stats> Client::stats(const RunContext& context) const {
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->admin,
                                    &v1::AdminService::Stub::Stats, v1::StatsRequest());
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<ServerInfo> Client::serverInfo(const RunContext& context) const {
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->admin,
                                    &v1::AdminService::Stub::ServerInfo, v1::ServerInfoRequest());
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<Health> Client::health(const std::string& service, const RunContext& context) const {
    Health health = Health::kUnknown;
    const auto made = makeCall(impl_->options, context, kOnce, [&](grpc::ClientContext& rpc, Result<void>&) {
        grpc::GenericStub stub(impl_->channel);
        grpc::CompletionQueue queue;
        const auto call =
            stub.PrepareUnaryCall(&rpc, "/grpc.health.v1.Health/Check", encodeHealthRequest(service), &queue);
        call->StartCall();
        grpc::ByteBuffer response;
        grpc::Status status;
        call->Finish(&response, &status, nullptr);
        void* tag = nullptr;
        bool ok = false;
        queue.Next(&tag, &ok);
        if (status.ok()) health = decodeHealthResponse(response);
        return status;
    });
    RETURN_IF_ERROR(made);
    return health;
}

}  // namespace shapedb::client
