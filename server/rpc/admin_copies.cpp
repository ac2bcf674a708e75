// SPDX-License-Identifier: GPL-3.0-or-later
// The part of AdminService that sends and receives database files: backup and restore of everything, export
// and import of one collection.
//
// The handlers keep the order of their steps here: the file is written and read in the messages of the
// stream, and the rules about the content are in the catalog.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "common/backup_manifest.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "server/files/temporary_file.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/backup_stream.h"
#include "server/rpc/call.h"
#include "server/rpc/receive_scan.h"

namespace shapedb::rpc {
namespace {

/// The received file, its private copy that is checked, and the log or the rows that take its content.
constexpr std::uint64_t kCopiesOfReceived = 3;

/// Has `make(path)` write a file of about `bytes`, and sends it, or only what has changed since `since`.
/// `what` begins messages, as "the backup".
template <typename Make>
Result<void> sendCopy(const Services& services, Call& call, Replies<v1::BackupChunk>& writer,
                      const char* what, const Result<std::uint64_t>& bytes, Make&& make,
                      std::optional<BackupManifest> since = std::nullopt) {
    RETURN_IF_ERROR(bytes);
    RETURN_IF_ERROR(files::requireFreeSpace(services.temporaryDirectory, *bytes, what));
    const auto file = files::TemporaryFile::create(services.temporaryDirectory);
    RETURN_IF_ERROR(file);
    RETURN_IF_ERROR(make(file->path()));
    const SendChunk send = [&](const v1::BackupChunk& chunk) { return call.write(writer, chunk); };
    if (!since) return sendFile(file->path(), call.run(), send);
    return sendIncrement(file->path(), std::move(*since), call.run(), send);
}

/// Where the chunks of a client go.
class ReceivedFile {
  public:
    /// `what` begins messages, as "the restore"; static storage.
    static Result<ReceivedFile> create(const std::string& directory, const char* what) {
        auto file = files::TemporaryFile::create(directory);
        RETURN_IF_ERROR(file);
        auto receiver = FileReceiver::create(file->path());
        RETURN_IF_ERROR(receiver);
        return ReceivedFile(directory, what, std::move(*file), std::move(*receiver));
    }

    /// Errors: those of FileReceiver::add; kStorageFull, before the disk is filled.
    Result<void> add(const v1::BackupChunk& chunk) {
        constexpr std::uint64_t kMost = ~std::uint64_t{0} / kCopiesOfReceived;
        if (chunk.total_bytes() > 0) {
            RETURN_IF_ERROR(files::requireFreeSpace(
                directory_, kCopiesOfReceived * std::min(chunk.total_bytes(), kMost), what_));
        }
        return receiver_.add(chunk);
    }
    /// Errors: those of FileReceiver::finish.
    Result<void> finish(Call& call) {
        RETURN_IF_ERROR(receiver_.finish());
        call.note({"bytes", receiver_.bytes()});
        return {};
    }
    [[nodiscard]] std::string path() const { return file_.path(); }

  private:
    ReceivedFile(std::string directory, const char* what, files::TemporaryFile file, FileReceiver receiver)
        : directory_(std::move(directory)),
          what_(what),
          file_(std::move(file)),
          receiver_(std::move(receiver)) {}

    std::string directory_;
    const char* what_;
    files::TemporaryFile file_;
    FileReceiver receiver_;
};

/// Takes the messages of an import in their order: one header, then chunks. Returns the name asked for. Takes
/// the place of a copy once it is known whether the caller may use that name.
Result<std::string> receiveExport(const Services& services, Call& call, catalog::Budget::Share& copy,
                                  Upload<v1::ImportCollectionRequest>& messages, ReceivedFile& file) {
    std::optional<std::string> name;
    const auto take = [&](const v1::ImportCollectionRequest& request) -> Result<void> {
        if (request.has_header() == name.has_value()) {
            return fail(ErrorCode::kMalformedStream,
                        name ? "second header" : "the first message must be the header");
        }
        if (request.has_chunk()) return file.add(request.chunk());
        name = request.header().collection();
        if (!name->empty()) {  // otherwise the file tells it
            RETURN_IF_ERROR(call.useCollection(*name));
            RETURN_IF_ERROR(services.catalog.admitImport(*name));
        }
        return copy.take(1);
    };
    RETURN_IF_ERROR(receiveHeaderAndChunks(services, messages, call, take));
    if (!name) return fail(ErrorCode::kMalformedStream, "the stream ended before the header");
    RETURN_IF_ERROR(file.finish(call));
    return *name;
}

}  // namespace

grpc::Status AdminServiceHandler::backup(grpc::ServerContext* context, Request<v1::BackupRequest>& request,
                                         Replies<v1::BackupChunk>* writer) {
    return handle(services_, context, operations::kBackup, request, [&](Call& call) -> Result<void> {
        std::optional<BackupManifest> since;
        if (request->has_since()) {
            auto manifest = checkedManifest(request->since());
            RETURN_IF_ERROR(manifest);
            call.note({"since", toHex(manifest->backup.sha256)});
            since = std::move(*manifest);
        }
        catalog::Budget::Share copy(services_.admission.copies);
        RETURN_IF_ERROR(copy.take(1));
        const auto bytes = services_.catalog.backupBytes();
        RETURN_IF_ERROR(bytes);
        return sendCopy(
            services_, call, *writer, "the backup", *bytes,
            [&](const std::string& path) { return services_.catalog.backup(path, call.run()); },
            std::move(since));
    });
}

grpc::Status AdminServiceHandler::restore(grpc::ServerContext* context, Upload<v1::BackupChunk>& chunks,
                                          v1::RestoreResponse* response) {
    return handle(services_, context, operations::kRestore, chunks, [&](Call& call) -> Result<void> {
        call.frame().expectRestore();
        catalog::Budget::Share copy(services_.admission.copies);
        RETURN_IF_ERROR(copy.take(1));
        auto file = ReceivedFile::create(services_.temporaryDirectory, "the restore");
        RETURN_IF_ERROR(file);
        RETURN_IF_ERROR(receiveMessages(services_, chunks, call,
                                        [&](const v1::BackupChunk& chunk) { return file->add(chunk); }));
        RETURN_IF_ERROR(file->finish(call));

        const auto mayReplace = [&] { return call.authorization().requireStill(); };
        RETURN_IF_ERROR(services_.catalog.restore(file->path(), call.run(), mayReplace));
        const auto stats = services_.catalog.stats();
        RETURN_IF_ERROR(stats);
        const store::StoreStats& stored = stats->store;
        response->set_collections(stored.collections);
        response->set_shapes(stored.shapesPending + stored.shapesReady + stored.shapesFailed);
        call.info("database replaced by a backup", {{"shapes", response->shapes()}});
        return {};
    });
}

grpc::Status AdminServiceHandler::exportCollection(grpc::ServerContext* context,
                                                   Request<v1::ExportCollectionRequest>& request,
                                                   Replies<v1::BackupChunk>* writer) {
    return handle(services_, context, operations::kExportCollection, request,
                  [&](Call& call) -> Result<void> {
                      const auto name = call.useCollection(request->collection());
                      RETURN_IF_ERROR(name);
                      catalog::Budget::Share copy(services_.admission.copies);
                      RETURN_IF_ERROR(copy.take(1));
                      return sendCopy(services_, call, *writer, "the export",
                                      services_.catalog.exportBytes(*name), [&](const std::string& path) {
                                          return services_.catalog.exportCollection(*name, path, call.run());
                                      });
                  });
}

grpc::Status AdminServiceHandler::importCollection(grpc::ServerContext* context,
                                                   Upload<v1::ImportCollectionRequest>& messages,
                                                   v1::ImportCollectionResponse* response) {
    return handle(
        services_, context, operations::kImportCollection, messages, [&](Call& call) -> Result<void> {
            catalog::Budget::Share copy(services_.admission.copies);
            auto file = ReceivedFile::create(services_.temporaryDirectory, "the import");
            RETURN_IF_ERROR(file);
            const auto name = receiveExport(services_, call, copy, messages, *file);
            RETURN_IF_ERROR(name);
            const auto mayUse = [&](const std::string& wanted) -> Result<void> {
                RETURN_IF_ERROR(call.useCollection(wanted));
                return call.authorization().requireStill();
            };
            const auto imported = services_.catalog.importCollection(file->path(), *name, mayUse, call.run());
            RETURN_IF_ERROR(imported);
            const auto counts = services_.catalog.countShapes(**imported);
            RETURN_IF_ERROR(counts);
            response->set_collection((*imported)->collection.name);
            response->set_shapes(counts->all);
            response->set_shapes_pending(counts->all - counts->ready - counts->failed);
            call.info("collection imported",
                      {{"collection", response->collection()}, {"shapes", response->shapes()}});
            return {};
        });
}

}  // namespace shapedb::rpc
