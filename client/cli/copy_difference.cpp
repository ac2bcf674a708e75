// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/copy_difference.h"

#include <algorithm>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/cli/parameters.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// Shapes per request: the server's limit.
constexpr std::uint32_t kCopyPage = 1000;

/// The shapes of a collection by key, page after page.
class ShapesByKey {
  public:
    ShapesByKey(const client::Client& client, const std::string& collection, const RunContext& context)
        : client_(client), context_(context) {
        request_.collection = collection;
        request_.order = client::ShapeOrder::kKey;
        request_.pageSize = kCopyPage;
    }

    /// The next one, which stays the next until `take`; null after the last.
    Result<client::Shape*> peek() {
        while (at_ == page_.shapes.size() && !ended_) {
            auto page = client_.listShapes(request_, context_);
            RETURN_IF_ERROR(page);
            page_ = std::move(*page);
            at_ = 0;
            request_.cursor = page_.nextCursor;
            ended_ = page_.nextCursor.empty();
        }
        return at_ < page_.shapes.size() ? &page_.shapes[at_] : nullptr;
    }
    client::Shape take() { return std::move(page_.shapes[at_++]); }

  private:
    const client::Client& client_;
    const RunContext& context_;
    client::ListRequest request_;
    client::ListPage page_;
    std::size_t at_ = 0;
    bool ended_ = false;
};

using Collections = std::map<std::string, const client::Collection*>;

Collections byName(const std::vector<client::Collection>& all) {
    Collections named;
    for (const client::Collection& one : all) named[one.name] = &one;
    return named;
}

/// The collection of each alias.
std::map<std::string, std::string> aliasesOf(const std::vector<client::Collection>& all) {
    std::map<std::string, std::string> aliases;
    for (const client::Collection& one : all) {
        for (const std::string& alias : one.aliases) aliases[alias] = one.name;
    }
    return aliases;
}

/// A plan in the making: what is there, as the steps so far leave it.
class Plan {
  public:
    Plan(const std::vector<client::Collection>& from, const std::vector<client::Collection>& to)
        : from_(byName(from)), to_(byName(to)), aliases_(aliasesOf(from)), aliasesThere_(aliasesOf(to)) {}

    void deleteAliases() {
        for (const auto& [alias, collection] : aliasesThere_) {
            if (aliases_.count(alias) == 0) add({CollectionStep::Kind::kDeleteAlias, alias, collection});
        }
    }

    void rename(const std::map<std::string, client::Timestamp>& madeOf) {
        Collections renamed;
        for (const auto& [name, there] : to_) {
            if (from_.count(name) != 0) continue;
            const auto made = madeOf.find(name);
            const client::Timestamp created = made == madeOf.end() ? there->created : made->second;
            const auto here = std::find_if(from_.begin(), from_.end(), [&](const auto& one) {
                return one.second->created == created && to_.count(one.first) == 0 &&
                       renamed.count(one.first) == 0;
            });
            if (here == from_.end()) continue;
            add({CollectionStep::Kind::kRename, name, here->first});
            renamed[here->first] = there;
            gone_.insert(name);
        }
        to_.merge(renamed);
    }

    /// Only a collection that was made anew has another description.
    void replace() {
        for (const auto& [name, there] : to_) {
            const auto here = from_.find(name);
            if (gone_.count(name) != 0) continue;
            if (here != from_.end() && here->second->description == there->description) continue;
            add({CollectionStep::Kind::kDelete, name});
            gone_.insert(name);
        }
    }

    void create() {
        for (const auto& [name, here] : from_) {
            const auto there = to_.find(name);
            if (there == to_.end() || gone_.count(name) != 0) {
                add({CollectionStep::Kind::kCreate, name, {}, *here});
            } else if (here->damage.empty() && there->second->damage.empty() &&
                       toJson(here->parameters) != toJson(there->second->parameters)) {
                add({CollectionStep::Kind::kRebuild, name, {}, *here});
            }
        }
    }

    void setAliases() {
        for (const auto& [alias, collection] : aliases_) {
            const auto there = aliasesThere_.find(alias);
            // The aliases of a collection go with it, and follow its new name.
            const bool stands = there != aliasesThere_.end() && gone_.count(there->second) == 0 &&
                                there->second == collection;
            if (!stands) add({CollectionStep::Kind::kSetAlias, alias, collection});
        }
    }

    std::vector<CollectionStep> steps;

  private:
    void add(CollectionStep step) { steps.push_back(std::move(step)); }

    Collections from_;
    Collections to_;
    std::map<std::string, std::string> aliases_;
    std::map<std::string, std::string> aliasesThere_;
    std::set<std::string> gone_;  ///< names there that are taken away
};

}  // namespace

ShapeDifference differenceOf(const ShapePair& pair) {
    if (!pair.to) return ShapeDifference::kMissing;
    if (!pair.from) return ShapeDifference::kExtra;
    const client::Shape& from = *pair.from;
    const client::Shape& to = *pair.to;
    if (from.sha256 != to.sha256 || from.pointCount != to.pointCount || from.origin != to.origin) {
        return ShapeDifference::kPoints;
    }
    if (from.metadata != to.metadata) return ShapeDifference::kMetadata;
    return from.state == to.state ? ShapeDifference::kNone : ShapeDifference::kState;
}

const char* differenceName(ShapeDifference difference) noexcept {
    switch (difference) {
        case ShapeDifference::kNone: return "";
        case ShapeDifference::kMissing: return "missing";
        case ShapeDifference::kExtra: return "extra";
        case ShapeDifference::kPoints: return "points";
        case ShapeDifference::kMetadata: return "metadata";
        case ShapeDifference::kState: return "state";
    }
    return "";
}

Result<void> visitPairs(const CopySides& sides, const std::string& collection,
                        const std::function<Result<void>(ShapePair&&)>& visit, const RunContext& context) {
    ShapesByKey from(sides.from, collection, context);
    ShapesByKey to(sides.to, collection, context);
    while (true) {
        const auto here = from.peek();
        RETURN_IF_ERROR(here);
        const auto there = to.peek();
        RETURN_IF_ERROR(there);
        if (*here == nullptr && *there == nullptr) return {};
        const int order = *here == nullptr ? 1 : *there == nullptr ? -1 : (*here)->key.compare((*there)->key);
        ShapePair pair;
        if (order <= 0) pair.from = from.take();
        if (order >= 0) pair.to = to.take();
        RETURN_IF_ERROR(visit(std::move(pair)));
    }
}

Result<std::vector<ShapePair>> pairsOf(const CopySides& sides, const std::string& collection,
                                       std::vector<client::Shape> from, const RunContext& context) {
    std::vector<ShapePair> pairs;
    if (from.empty()) return pairs;
    std::vector<std::string> keys;
    for (const client::Shape& shape : from) keys.push_back(shape.key);
    auto found = sides.to.getShapes(collection, keys, context);
    RETURN_IF_ERROR(found);
    std::map<std::string, client::Shape> there;
    for (client::Shape& shape : found->shapes) {
        std::string key = shape.key;
        there.emplace(std::move(key), std::move(shape));
    }
    for (client::Shape& shape : from) {
        ShapePair pair;
        const auto other = there.find(shape.key);
        if (other != there.end()) pair.to = other->second;
        pair.from = std::move(shape);
        pairs.push_back(std::move(pair));
    }
    return pairs;
}

std::vector<CollectionStep> stepsBetween(const std::vector<client::Collection>& from,
                                         const std::vector<client::Collection>& to,
                                         const std::map<std::string, client::Timestamp>& madeOf) {
    Plan plan(from, to);
    plan.deleteAliases();
    plan.rename(madeOf);
    plan.replace();
    plan.create();
    plan.setAliases();
    return std::move(plan.steps);
}

std::string stepText(const CollectionStep& step) {
    switch (step.kind) {
        case CollectionStep::Kind::kDeleteAlias: return "alias " + step.name + " is no longer there";
        case CollectionStep::Kind::kRename: return "collection " + step.name + " is now " + step.other;
        case CollectionStep::Kind::kDelete: return "collection " + step.name + " is no longer there";
        case CollectionStep::Kind::kCreate: return "collection " + step.name + " is missing";
        case CollectionStep::Kind::kRebuild: return "collection " + step.name + " has other parameters";
        case CollectionStep::Kind::kSetAlias: return "alias " + step.name + " stands for " + step.other;
    }
    return {};
}

}  // namespace shapedb::cli
