// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/damaged_collection.h"

#include <string>
#include <utility>

#include "server/store/failure.h"

namespace shapedb::index {
namespace {

std::shared_ptr<Snapshot> marked(Snapshot snapshot, const char* what, const Error& why,
                                 const std::string& remedy) {
    const store::Collection& collection = snapshot.collection;
    const std::string name =
        collection.name.empty() ? "with id " + std::to_string(collection.id) : "'" + collection.name + "'";
    snapshot.damage =
        Error{ErrorCode::kDataLoss, "collection " + name + " cannot be searched, " + what + " (" +
                                        why.message + "): " + store::kDamageRemedy + remedy};
    return std::make_shared<Snapshot>(std::move(snapshot));
}

Snapshot withUnknownParameters(const store::Collection& collection) {
    Snapshot snapshot;
    snapshot.collection = collection;
    snapshot.parametersKnown = false;
    return snapshot;
}

}  // namespace

std::shared_ptr<Snapshot> withoutRow(const store::Collection& collection) {
    return marked(withUnknownParameters(collection), "its row in table collection could not be read",
                  *collection.damage, "");
}

std::shared_ptr<Snapshot> withoutParameters(const store::Collection& collection, const Error& why) {
    return marked(withUnknownParameters(collection), "its parameters in table collection could not be read",
                  why,
                  ", or give it new ones with 'shapedb admin rebuild --profile default --collection " +
                      collection.name + "'");
}

std::shared_ptr<Snapshot> withoutSearches(const Snapshot& empty, const Error& why) {
    return marked(empty, "its signatures could not be read", why,
                  ", or try 'shapedb admin rebuild --collection " + empty.collection.name + "'");
}

}  // namespace shapedb::index
