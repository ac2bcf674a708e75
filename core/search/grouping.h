// SPDX-License-Identifier: GPL-3.0-or-later
// Groups of hits: shapes with the same value under a metadata key.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/search/signature_set.h"

namespace shapedb {

/// Which shapes belong together. Shapes without the key are a group too.
struct Grouping {
    std::string key;           ///< of the metadata
    std::size_t perGroup = 1;  ///< hits of each group at most; at least 1
};

/// Null: the shapes of the group do not have the key. Points into the set or block that it was read from.
using GroupValue = const std::string*;

/// The group of a row, or of the shape with this id, which must be in the set.
[[nodiscard]] inline GroupValue groupOf(const SignatureBlock& block, std::size_t row,
                                        const std::string& key) {
    const Metadata& metadata = block.metadata(row);
    const auto found = metadata.find(key);
    return found == metadata.end() ? nullptr : &found->second;
}
[[nodiscard]] inline GroupValue groupOf(const SignatureSet& set, std::int64_t id, const std::string& key) {
    const SignatureSet::Place place = set.find(id);
    return groupOf(*place.block, place.row, key);
}

/// A value for each of some groups.
template <typename Value>
class GroupMap {
  public:
    /// Null if the group has none.
    [[nodiscard]] const Value* find(GroupValue group) const {
        if (group == nullptr) return hasWithout_ ? &without_ : nullptr;
        const auto found = values_.find(*group);
        return found == values_.end() ? nullptr : &found->second;
    }
    [[nodiscard]] Value& operator[](GroupValue group) {
        if (group != nullptr) return values_[*group];
        hasWithout_ = true;
        return without_;
    }
    [[nodiscard]] std::size_t size() const { return values_.size() + (hasWithout_ ? 1 : 0); }
    void clear() { *this = GroupMap(); }

  private:
    std::unordered_map<std::string_view, Value> values_;
    Value without_{};
    bool hasWithout_ = false;
};

/// Keeps, of hits ordered by rank, the first `perGroup` of each of the first `k` groups, in the same order.
/// `groupOfHit(hit)` is a GroupValue.
template <typename Hit, typename GroupOfHit>
void keepBestOfGroups(std::vector<Hit>& hits, std::size_t k, std::size_t perGroup,
                      const GroupOfHit& groupOfHit) {
    GroupMap<std::size_t> kept;
    std::size_t end = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const GroupValue group = groupOfHit(hits[i]);
        if (kept.find(group) == nullptr && kept.size() == k) continue;
        std::size_t& count = kept[group];
        if (count == perGroup) continue;
        ++count;
        if (end != i) hits[end] = std::move(hits[i]);
        ++end;
    }
    hits.erase(hits.begin() + static_cast<std::ptrdiff_t>(end), hits.end());
}

/// Puts hits in the order of their rank group after group, each where its best hit stands.
template <typename Hit, typename GroupOfHit>
void bringGroupsTogether(std::vector<Hit>& hits, const GroupOfHit& groupOfHit) {
    GroupMap<std::size_t> places;
    std::vector<std::vector<Hit>> groups;
    for (Hit& hit : hits) {
        const GroupValue group = groupOfHit(hit);
        if (places.find(group) == nullptr) {
            places[group] = groups.size();
            groups.emplace_back();
        }
        groups[*places.find(group)].push_back(std::move(hit));
    }
    hits.clear();
    for (std::vector<Hit>& group : groups) {
        for (Hit& hit : group) hits.push_back(std::move(hit));
    }
}

}  // namespace shapedb
