// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/align_service.h"

#include <variant>

#include "core/base/return_if_error.h"
#include "server/rpc/convert.h"
#include "server/rpc/receive_scan.h"

namespace shapedb::rpc {

namespace {

// The one or two scans of a call.
class Uploads {
  public:
    Uploads(const Services& services, Call& call)
        : call_(call),
          query_(services.config.limits.maxPoints, services.admission.uploads),
          other_(services.config.limits.maxPoints, services.admission.uploads) {}

    Result<void> take(const v1::AlignRequest& message) {
        if (message.has_header()) return begin(message.header());
        const bool ofQuery = header_.other_points() == 0 || query_.points() < header_.query_points();
        return receiveChunk(message.chunk().xyz(), ofQuery ? query_ : other_, call_);
    }

    Result<store::VerifiedScan> query() {
        return finished("query: ", query_, isolationFrom(header_.query_isolation()));
    }
    Result<store::VerifiedScan> other() {
        return finished("other: ", other_, isolationFrom(header_.other_isolation()));
    }
    const v1::AlignHeader& header() const { return header_; }
    /// Of the key in the header.
    const std::string& collection() const { return collection_; }

  private:
    Result<void> begin(const v1::AlignHeader& header) {
        auto begun =
            query_.begin(header.query_points(), header.query_sha256(), fromProto(header.query_origin()));
        if (!begun) return fail(withContext(begun.error(), "query: "));
        if (header.other_case() == v1::AlignHeader::OTHER_NOT_SET) {
            return fail(ErrorCode::kInvalidArgument, "other: give a key, or other_points and a second scan");
        }
        if (header.has_key()) {
            call_.noteKey(header.key().key());
            auto collection = call_.useCollection(header.key().collection());
            RETURN_IF_ERROR(collection);
            collection_ = std::move(*collection);
        }
        RETURN_IF_ERROR(call_.useScan(header.query_points()));
        if (header.has_other_points()) {
            begun =
                other_.begin(header.other_points(), header.other_sha256(), fromProto(header.other_origin()));
            if (!begun) return fail(withContext(begun.error(), "other: "));
            RETURN_IF_ERROR(call_.useScan(header.other_points()));
        }
        header_ = header;
        return {};
    }

    Result<store::VerifiedScan> finished(const char* which, catalog::ScanUpload& upload,
                                         const IsolateOptions& isolation) {
        auto scan = upload.finish();
        if (scan) scan = catalog::isolated(std::move(*scan), isolation, call_.run());
        if (!scan) return fail(withContext(scan.error(), which));
        return scan;
    }

    Call& call_;
    catalog::ScanUpload query_;
    catalog::ScanUpload other_;
    v1::AlignHeader header_;  // empty until it arrives
    std::string collection_;
};

FitOptions optionsFrom(const v1::AlignHeader& header) {
    FitOptions options;
    options.keepScale = header.keep_scale();
    options.reflection = !header.forbid_reflection();
    options.kinds.whole = !header.partial();
    return options;
}

}  // namespace

AlignServiceHandler::AlignServiceHandler(const Services& services) : services_(services) {
    serve("Align", this, &AlignServiceHandler::align);
}

grpc::Status AlignServiceHandler::align(grpc::ServerContext* context, Upload<v1::AlignRequest>& messages,
                                        v1::AlignResponse* response) {
    return handle(services_, context, operations::kAlign, messages, [&](Call& call) -> Result<void> {
        Uploads uploads(services_, call);
        const auto take = [&](const v1::AlignRequest& message) { return uploads.take(message); };
        RETURN_IF_ERROR(receiveHeaderAndChunks(services_, messages, call, take));
        const auto query = uploads.query();
        RETURN_IF_ERROR(query);
        const v1::AlignHeader& header = uploads.header();
        const auto align = [&](const std::variant<catalog::ShapeName, const store::VerifiedScan*>& other) {
            return services_.searches.align(*query, other, optionsFrom(header), header.free_scale(),
                                            call.run());
        };
        Result<catalog::Alignment> aligned = fail(ErrorCode::kInternal, "not aligned");
        if (header.has_key()) {
            aligned = align(catalog::ShapeName{uploads.collection(), header.key().key()});
        } else {
            const auto other = uploads.other();
            RETURN_IF_ERROR(other);
            aligned = align(&*other);
        }
        RETURN_IF_ERROR(aligned);
        toProto(aligned->fit, response->mutable_fit());
        response->set_unit(wire::toProto(aligned->unit));
        return {};
    });
}

}  // namespace shapedb::rpc
