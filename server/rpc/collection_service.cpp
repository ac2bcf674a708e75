#include "server/rpc/collection_service.h"

#include "core/base/return_if_error.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/request_checks.h"
#include "server/store/parameters_codec.h"

namespace shapedb::rpc {
namespace {

/// The collection with its counts.
Result<void> fill(const Services& services, const index::Snapshot& snapshot, v1::Collection* out) {
    const std::int64_t id = snapshot.collection.id;
    const auto count = [&](std::optional<store::ShapeState> state) {
        return services.store.countShapes(id, {state, nullptr});
    };
    const auto all = count(std::nullopt);
    const auto ready = count(store::ShapeState::kReady);
    const auto failed = count(store::ShapeState::kFailed);
    for (const auto& result : {all, ready, failed}) {
        RETURN_IF_ERROR(result);
    }
    toProto(snapshot.collection, snapshot.parameters, out);
    out->set_shapes(*all);
    out->set_shapes_ready(*ready);
    out->set_shapes_failed(*failed);
    return {};
}

}  // namespace

grpc::Status CollectionServiceHandler::CreateCollection(grpc::ServerContext* context,
                                                        const v1::CreateCollectionRequest* request,
                                                        v1::Collection* response) {
    return handle(services_, context, "CreateCollection", [&](Call& call) -> Result<void> {
        call.note({"collection", request->name()});
        RETURN_IF_ERROR(checkCollectionName(request->name()));
        RETURN_IF_ERROR(checkDescription(request->description()));
        const auto parameters = parametersFrom(request->profile(), request->segmentation(),
                                               request->signature(), parametersOf(Profile::kDefault));
        RETURN_IF_ERROR(parameters);
        const RestoreGate::Write write(services_.restores);
        const auto created = services_.store.createCollection(request->name(), request->description(),
                                                              index::encodeParameters(*parameters));
        RETURN_IF_ERROR(created);
        const auto added = services_.index.add(*created);
        RETURN_IF_ERROR(added);
        return fill(services_, **added, response);
    });
}

grpc::Status CollectionServiceHandler::GetCollection(grpc::ServerContext* context,
                                                     const v1::GetCollectionRequest* request,
                                                     v1::Collection* response) {
    return handle(services_, context, "GetCollection", [&](Call& call) -> Result<void> {
        const auto found = call.collection(request->name());
        RETURN_IF_ERROR(found);
        return fill(services_, **found, response);
    });
}

grpc::Status CollectionServiceHandler::ListCollections(grpc::ServerContext* context,
                                                       const v1::ListCollectionsRequest*,
                                                       v1::ListCollectionsResponse* response) {
    return handle(services_, context, "ListCollections", [&](Call&) -> Result<void> {
        for (const index::SnapshotPtr& snapshot : services_.index.all()) {
            RETURN_IF_ERROR(fill(services_, *snapshot, response->add_collections()));
        }
        return {};
    });
}

grpc::Status CollectionServiceHandler::DeleteCollection(grpc::ServerContext* context,
                                                        const v1::DeleteCollectionRequest* request,
                                                        v1::DeleteCollectionResponse*) {
    return handle(services_, context, "DeleteCollection", [&](Call& call) -> Result<void> {
        // No default here: nobody deletes a collection by forgetting its name.
        RETURN_IF_ERROR(checkCollectionName(request->name()));
        const RestoreGate::Write write(services_.restores);
        const auto found = call.collection(request->name());
        RETURN_IF_ERROR(found);
        const store::Collection& collection = (*found)->collection;
        if (!request->force()) {
            const auto shapes = services_.store.countShapes(collection.id, {});
            RETURN_IF_ERROR(shapes);
            if (*shapes > 0) {
                return fail(ErrorCode::kRejected, "collection '" + collection.name + "' holds " +
                                                      std::to_string(*shapes) +
                                                      " shapes: delete them first, or set force");
            }
        }
        const auto cancelled = services_.rebuilds.cancel(collection);
        if (!cancelled && cancelled.error().code != ErrorCode::kNotFound) return cancelled;
        RETURN_IF_ERROR(services_.store.deleteCollection(collection.id));
        services_.index.remove(collection.id);
        services_.workers.supersedeCollection(collection.id);
        return {};
    });
}

}  // namespace shapedb::rpc
