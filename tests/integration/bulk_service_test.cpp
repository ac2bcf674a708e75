// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of many shapes, batches, orders, counts, groups and aliases on a live server.
#include <algorithm>
#include <future>
#include <map>
#include <set>

#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;
using Shapes = pb::ShapeService::Stub;

class BulkRpc : public LiveTest {
  protected:
    void add(const std::string& key, std::uint64_t seed,
             const std::map<std::string, std::string>& metadata = {}) {
        const auto added = addAndWait(client, collection, key, dumbbell(seed, 400), metadata);
        ASSERT_TRUE(added.ok()) << added;
    }
    pb::Shape get(const std::string& key) { return getShape(client, collection, key).value; }
    std::uint64_t count(const std::string& filter = "") {
        pb::CountShapesRequest request;
        request.set_collection(collection);
        request.set_filter(filter);
        return unary(*client.shapes, &Shapes::CountShapes, request).value.count();
    }
    pb::UpdateMetadataRequest update(const std::string& key) const {
        pb::UpdateMetadataRequest request;
        request.set_collection(collection);
        if (!key.empty()) request.set_key(key);
        return request;
    }
    Reply<pb::UpdateMetadataResponse> send(const pb::UpdateMetadataRequest& request) {
        return unary(*client.shapes, &Shapes::UpdateMetadata, request);
    }
    template <typename Request>
    Request onKeys(const std::vector<std::string>& keys) const {
        Request request;
        request.set_collection(collection);
        for (const std::string& key : keys) request.mutable_selection()->mutable_keys()->add_keys(key);
        return request;
    }
    template <typename Request>
    Request onFilter(const std::string& filter) const {
        Request request;
        request.set_collection(collection);
        request.mutable_selection()->set_filter(filter);
        return request;
    }
    std::vector<std::string> keysBy(pb::ShapeOrder order, bool descending, const std::string& prefix = "") {
        std::vector<std::string> keys;
        pb::ListShapesRequest request;
        request.set_collection(collection);
        request.set_order(order);
        request.set_descending(descending);
        request.set_key_prefix(prefix);
        request.set_page_size(2);
        do {
            const auto page = unary(*client.shapes, &Shapes::ListShapes, request);
            EXPECT_TRUE(page.ok()) << page;
            for (const pb::Shape& shape : page.value.shapes()) keys.push_back(shape.key());
            request.set_cursor(page.value.next_cursor());
        } while (!request.cursor().empty());
        return keys;
    }
};

void expectRefused(const Outcome& outcome, StatusCode code, const std::string& error) {
    EXPECT_EQ(outcome.status.error_code(), code) << outcome;
    EXPECT_EQ(outcome.error, error) << outcome;
    EXPECT_FALSE(outcome.status.error_message().empty());
}

TEST_F(BulkRpc, MetadataChangeWithoutPointsAndSearchesSeeThem) {
    add("a", 1, {{"label", "old"}, {"year", "1990"}});
    add("b", 2, {{"label", "old"}});
    const pb::Shape before = get("a");
    auto request = update("a");
    (*request.mutable_change()->mutable_set())["label"] = "new";
    request.mutable_change()->add_remove("year");
    request.set_expected_version(1);
    const auto changed = send(request);
    ASSERT_TRUE(changed.ok()) << changed;
    EXPECT_EQ(changed.value.changed(), 1u);
    EXPECT_EQ(changed.value.shape().version(), 2);
    EXPECT_EQ(changed.value.shape().metadata_size(), 1);
    EXPECT_EQ(changed.value.shape().state(), pb::SHAPE_STATE_READY);
    EXPECT_EQ(changed.value.shape().sha256(), before.sha256());
    EXPECT_EQ(send(request).value.unchanged(), 1u) << "a repeated request";
    request.set_expected_version(7);
    expectRefused(send(request), StatusCode::ABORTED, "version_conflict");

    pb::SearchByKeyRequest search;
    *search.mutable_options() = searchOptions(collection);
    search.mutable_options()->set_filter("label=new");
    search.set_key("b");
    const auto found = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, search);
    ASSERT_EQ(found.value.hits_size(), 1) << found;
    EXPECT_EQ(found.value.hits(0).shape().key(), "a");

    auto all = update("");
    all.set_filter("");
    (*all.mutable_change()->mutable_set())["seen"] = "yes";
    const auto many = send(all);
    EXPECT_EQ(many.value.changed(), 2u) << many;
    EXPECT_FALSE(many.value.has_shape());
    EXPECT_EQ(count("seen=yes"), 2u);
}

TEST_F(BulkRpc, RefusesBadChanges) {
    add("a", 1);
    const auto invalid = [&](const pb::UpdateMetadataRequest& request) {
        expectRefused(send(request), StatusCode::INVALID_ARGUMENT, "invalid_argument");
    };
    auto both = update("a");
    (*both.mutable_change()->mutable_set())["x"] = "y";
    both.mutable_change()->add_remove("x");
    invalid(both);
    auto key = update("a");
    (*key.mutable_change()->mutable_set())["a b"] = "y";
    invalid(key);
    auto value = update("a");
    (*value.mutable_change()->mutable_set())["x"] = std::string(1'025, 'v');
    invalid(value);
    auto replaced = update("a");
    replaced.mutable_change()->set_replace_all(true);
    replaced.mutable_change()->add_remove("x");
    invalid(replaced);
    auto version = update("");
    version.set_filter("");
    version.set_expected_version(1);
    invalid(version);
    invalid(update(""));
    auto filter = update("");
    filter.set_filter("a b");
    expectRefused(send(filter), StatusCode::INVALID_ARGUMENT, "malformed_filter");
    expectRefused(send(update("none")), StatusCode::NOT_FOUND, "not_found");
    auto nowhere = update("a");
    nowhere.set_collection("nowhere");
    expectRefused(send(nowhere), StatusCode::NOT_FOUND, "not_found");
    EXPECT_EQ(get("a").version(), 1);

    const auto remove = [&](const pb::DeleteShapesRequest& request) {
        return unary(*client.shapes, &Shapes::DeleteShapes, request);
    };
    pb::DeleteShapesRequest neither;
    neither.set_collection(collection);
    expectRefused(remove(neither), StatusCode::INVALID_ARGUMENT, "invalid_argument");
    expectRefused(remove(onKeys<pb::DeleteShapesRequest>({"a", std::string("\x01")})),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    expectRefused(remove(onFilter<pb::DeleteShapesRequest>("==")), StatusCode::INVALID_ARGUMENT,
                  "malformed_filter");
    expectRefused(remove(onKeys<pb::DeleteShapesRequest>(std::vector<std::string>(1'001, "a"))),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    EXPECT_EQ(count(), 1u);
}

TEST_F(BulkRpc, DeletesByKeysAndByFilter) {
    for (int i = 0; i < 4; ++i) add("k" + std::to_string(i), 1, {{"odd", i % 2 == 0 ? "no" : "yes"}});
    const auto some =
        unary(*client.shapes, &Shapes::DeleteShapes, onKeys<pb::DeleteShapesRequest>({"k0", "none", "k0"}));
    ASSERT_TRUE(some.ok()) << some;
    EXPECT_EQ(some.value.deleted(), 1u);
    ASSERT_EQ(some.value.missing_size(), 1);
    EXPECT_EQ(some.value.missing(0), "none");
    const auto odd =
        unary(*client.shapes, &Shapes::DeleteShapes, onFilter<pb::DeleteShapesRequest>("odd=yes"));
    EXPECT_EQ(odd.value.deleted(), 2u) << odd;
    EXPECT_EQ(count(), 1u);
    EXPECT_EQ(get("k2").key(), "k2");
}

TEST_F(BulkRpc, ReadsManyShapesAtOnceAndNamesWhatIsMissing) {
    add("a", 1);
    add("b", 2);
    pb::GetShapesRequest request;
    request.set_collection(collection);
    for (const char* key : {"b", "none", "a", "b"}) request.add_keys(key);
    const auto found = unary(*client.shapes, &Shapes::GetShapes, request);
    ASSERT_TRUE(found.ok()) << found;
    ASSERT_EQ(found.value.shapes_size(), 3);
    EXPECT_EQ(found.value.shapes(0).SerializeAsString().size(), get("b").SerializeAsString().size());
    EXPECT_EQ(found.value.shapes(0).key(), "b");
    EXPECT_EQ(found.value.shapes(1).key(), "a");
    ASSERT_EQ(found.value.missing_size(), 1);
    EXPECT_EQ(found.value.missing(0), "none");
    request.clear_keys();
    expectRefused(unary(*client.shapes, &Shapes::GetShapes, request), StatusCode::INVALID_ARGUMENT,
                  "invalid_argument");
}

TEST_F(BulkRpc, PointsComeBackBitForBit) {
    Scan scan = dumbbell(3, 100'000);  // more than one chunk
    scan[0] = -0.0f;
    ASSERT_TRUE(addShape(client, headerFor(collection, "a", scan), scan).ok());
    pb::GetPointsRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key("a");
    CallContext context;
    const auto reader = client.shapes->GetPoints(&context, request);
    const auto stream = drain(context, *reader);
    ASSERT_TRUE(stream.ok()) << stream;
    ASSERT_GT(stream.messages.size(), 2u);
    EXPECT_EQ(stream.messages[0].shape().key(), "a");
    EXPECT_EQ(stream.messages[0].shape().sha256(), sha256Of(scan));
    std::string bytes;
    for (std::size_t i = 1; i < stream.messages.size(); ++i) {
        EXPECT_LE(stream.messages[i].chunk().xyz().size(), std::size_t{1} << 20);
        EXPECT_EQ(stream.messages[i].chunk().xyz().size() % 12, 0u);
        bytes += stream.messages[i].chunk().xyz();
    }
    EXPECT_EQ(bytes, bytesOf(scan));

    request.mutable_shape()->set_key("none");
    CallContext missing;
    const auto none = client.shapes->GetPoints(&missing, request);
    expectRefused(drain(missing, *none), StatusCode::NOT_FOUND, "not_found");
}

TEST_F(BulkRpc, ListsInEveryOrderAndByPrefix) {
    for (const char* key : {"b/2", "a/1", "b/1", "a"}) add(key, 1);
    using Keys = std::vector<std::string>;
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_UNSPECIFIED, false), (Keys{"b/2", "a/1", "b/1", "a"}));
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_ID, true), (Keys{"a", "b/1", "a/1", "b/2"}));
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_KEY, false), (Keys{"a", "a/1", "b/1", "b/2"}));
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_KEY, true, "b/"), (Keys{"b/2", "b/1"}));
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_UPDATED, true).size(), 4u);
    auto request = update("b/2");
    (*request.mutable_change()->mutable_set())["x"] = "y";
    ASSERT_TRUE(send(request).ok());
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_UPDATED, true).front(), "b/2");
    EXPECT_EQ(keysBy(pb::SHAPE_ORDER_UPDATED, false).back(), "b/2");

    pb::ListShapesRequest list;
    list.set_collection(collection);
    list.set_page_size(1);
    const auto page = unary(*client.shapes, &Shapes::ListShapes, list);
    list.set_cursor(page.value.next_cursor());
    list.set_order(pb::SHAPE_ORDER_KEY);
    expectRefused(unary(*client.shapes, &Shapes::ListShapes, list), StatusCode::INVALID_ARGUMENT,
                  "malformed_cursor");
    list.clear_cursor();
    list.set_order(static_cast<pb::ShapeOrder>(9));
    expectRefused(unary(*client.shapes, &Shapes::ListShapes, list), StatusCode::INVALID_ARGUMENT,
                  "invalid_argument");
    list.set_order(pb::SHAPE_ORDER_ID);
    list.set_key_prefix(std::string(513, 'k'));
    expectRefused(unary(*client.shapes, &Shapes::ListShapes, list), StatusCode::INVALID_ARGUMENT,
                  "invalid_argument");
}

TEST_F(BulkRpc, CountsTheValuesOfAKey) {
    const std::vector<std::string> labels = {"cup", "jug", "cup", "", "vase"};
    for (std::size_t i = 0; i < labels.size(); ++i) {
        std::map<std::string, std::string> metadata = {{"odd", i % 2 == 0 ? "no" : "yes"}};
        if (!labels[i].empty()) metadata["label"] = labels[i];
        add("k" + std::to_string(i), 1, metadata);
    }
    pb::CountByValueRequest request;
    request.set_collection(collection);
    request.set_metadata_key("label");
    request.set_max_values(2);
    const auto counts = unary(*client.shapes, &Shapes::CountByValue, request);
    ASSERT_TRUE(counts.ok()) << counts;
    ASSERT_EQ(counts.value.values_size(), 2);
    EXPECT_EQ(counts.value.values(0).value(), "cup");
    EXPECT_EQ(counts.value.values(0).shapes(), 2u);
    EXPECT_EQ(counts.value.values(1).value(), "jug");
    EXPECT_EQ(counts.value.other_values(), 1u);
    EXPECT_EQ(counts.value.other_shapes(), 1u);
    EXPECT_EQ(counts.value.shapes_without(), 1u);
    request.set_filter("odd=no");
    EXPECT_EQ(unary(*client.shapes, &Shapes::CountByValue, request).value.values(1).value(), "vase");
    request.set_max_values(1'001);
    expectRefused(unary(*client.shapes, &Shapes::CountByValue, request), StatusCode::INVALID_ARGUMENT,
                  "invalid_argument");
    request.set_max_values(0);
    request.set_metadata_key("");
    expectRefused(unary(*client.shapes, &Shapes::CountByValue, request), StatusCode::INVALID_ARGUMENT,
                  "invalid_argument");
}

TEST_F(BulkRpc, FailedShapesAreTriedAgain) {
    const Scan open = openSheet();
    const auto failed = addAndWait(client, collection, "open", open, {});
    ASSERT_EQ(failed.value.shape().state(), pb::SHAPE_STATE_FAILED) << failed;
    add("good", 1);
    const auto retried =
        unary(*client.shapes, &Shapes::RetryShapes, onKeys<pb::RetryShapesRequest>({"open", "good", "none"}));
    ASSERT_TRUE(retried.ok()) << retried;
    EXPECT_EQ(retried.value.queued(), 1u);
    EXPECT_EQ(retried.value.left(), 0u);
    ASSERT_EQ(retried.value.not_failed_size(), 1);
    EXPECT_EQ(retried.value.not_failed(0), "good");
    ASSERT_EQ(retried.value.missing_size(), 1);
    EXPECT_TRUE(eventually([&] { return get("open").state() == pb::SHAPE_STATE_FAILED; }));
    EXPECT_EQ(
        unary(*client.shapes, &Shapes::RetryShapes, onFilter<pb::RetryShapesRequest>("")).value.queued(), 1u);
}

TEST_F(BulkRpc, AnUploadWithoutMetadataLeavesThem) {
    add("a", 1, {{"label", "cup"}});
    const Scan other = dumbbell(2, 400);
    pb::AddShapeHeader header = headerFor(collection, "a", other);
    header.set_mode(pb::ADD_MODE_SAME_POINTS);
    expectRefused(addShape(client, header, other), StatusCode::ALREADY_EXISTS, "already_exists");
    header.set_mode(pb::ADD_MODE_UPSERT);
    const auto kept = addShape(client, header, other);
    EXPECT_EQ(kept.value.shape().metadata().at("label"), "cup") << kept;
    header.mutable_metadata_change()->set_replace_all(true);
    const auto cleared = addShape(client, header, other);
    EXPECT_EQ(cleared.value.outcome(), pb::AddShapeResponse::OUTCOME_METADATA_CHANGED);
    EXPECT_EQ(cleared.value.shape().metadata_size(), 0);
    (*header.mutable_metadata())["label"] = "cup";
    expectRefused(addShape(client, header, other), StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

// The groups are those of the whole ranking.
TEST_F(BulkRpc, GroupsAreThoseOfTheFullRanking) {
    std::map<std::string, std::string> labelOf;
    for (int i = 0; i < 12; ++i) {
        const std::string key = "k" + std::to_string(i);
        const char* families[] = {"mug", "fish", "human", "table"};
        const Scan scan = familyScan(families[i % 4], static_cast<std::size_t>(i / 4), 5, 800);
        std::map<std::string, std::string> metadata;
        if (i % 4 != 3) metadata["kind"] = families[i % 4];
        labelOf[key] = i % 4 != 3 ? families[i % 4] : "(none)";
        ASSERT_TRUE(addAndWait(client, collection, key, scan, metadata).ok());
    }
    pb::SearchByKeyRequest request;
    *request.mutable_options() = searchOptions(collection, 12);
    request.set_key("k0");
    const auto full = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request);
    ASSERT_EQ(full.value.hits_size(), 11) << full;
    for (const std::uint32_t perGroup : {1u, 2u}) {
        for (const std::uint32_t k : {2u, 4u}) {
            request.mutable_options()->set_k(k);
            request.mutable_options()->set_group_by("kind");
            request.mutable_options()->set_per_group(perGroup);
            const auto grouped = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request);
            ASSERT_TRUE(grouped.ok()) << grouped;
            std::vector<std::string> order;
            std::map<std::string, std::vector<std::string>> groups;
            for (const pb::Hit& hit : full.value.hits()) {
                const std::string& label = labelOf.at(hit.shape().key());
                if (groups.count(label) == 0) {
                    if (order.size() == k) continue;
                    order.push_back(label);
                }
                if (groups[label].size() < perGroup) groups[label].push_back(hit.shape().key());
            }
            std::vector<std::string> expected;
            for (const std::string& label : order) {
                expected.insert(expected.end(), groups[label].begin(), groups[label].end());
            }
            std::vector<std::string> keys;
            for (const pb::Hit& hit : grouped.value.hits()) keys.push_back(hit.shape().key());
            EXPECT_EQ(keys, expected) << "k " << k << " of each " << perGroup;
            ASSERT_EQ(grouped.value.groups_size(), static_cast<int>(order.size()));
            for (int g = 0; g < grouped.value.groups_size(); ++g) {
                const pb::HitGroup& group = grouped.value.groups(g);
                const std::string& label = order[static_cast<std::size_t>(g)];
                EXPECT_EQ(group.has_value() ? group.value() : "(none)", label);
                EXPECT_EQ(group.hits(), groups[label].size());
            }
        }
    }
    request.mutable_options()->set_per_group(101);
    expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    request.mutable_options()->set_per_group(50);
    expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
    request.mutable_options()->set_per_group(1);
    request.mutable_options()->clear_group_by();
    expectRefused(unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");
}

TEST_F(BulkRpc, AliasesAndNewNamesAreTakenEverywhere) {
    using Collections = pb::CollectionService::Stub;
    add("a", 1);
    const std::string alias = collection + "-live";
    pb::SetAliasRequest set;
    set.set_alias(alias);
    set.set_collection(collection);
    const auto named = unary(*client.collections, &Collections::SetAlias, set);
    ASSERT_TRUE(named.ok()) << named;
    EXPECT_EQ(named.value.name(), collection);
    ASSERT_EQ(named.value.aliases_size(), 1);
    EXPECT_EQ(named.value.aliases(0), alias);
    EXPECT_EQ(getShape(client, alias, "a").value.collection(), collection);
    EXPECT_TRUE(addAndWait(client, alias, "b", dumbbell(2, 400)).ok());
    EXPECT_EQ(listAll(client, alias).size(), 2u);
    EXPECT_TRUE(searchByScan(client, searchOptions(alias), dumbbell(2, 400)).ok());
    expectRefused(createCollection(client, alias), StatusCode::ALREADY_EXISTS, "already_exists");

    pb::RenameCollectionRequest rename;
    rename.set_name(collection);
    rename.set_new_name(collection + "-renamed");
    const auto renamed = unary(*client.collections, &Collections::RenameCollection, rename);
    ASSERT_TRUE(renamed.ok()) << renamed;
    EXPECT_EQ(renamed.value.shapes(), 2u);
    EXPECT_EQ(getShape(client, alias, "a").value.collection(), collection + "-renamed");
    expectRefused(getShape(client, collection, "a"), StatusCode::NOT_FOUND, "not_found");
    expectRefused(unary(*client.collections, &Collections::RenameCollection, rename), StatusCode::NOT_FOUND,
                  "not_found");
    rename.set_name("default");
    expectRefused(unary(*client.collections, &Collections::RenameCollection, rename),
                  StatusCode::FAILED_PRECONDITION, "rejected");
    rename.set_name(collection + "-renamed");
    rename.set_new_name("a b");
    expectRefused(unary(*client.collections, &Collections::RenameCollection, rename),
                  StatusCode::INVALID_ARGUMENT, "invalid_argument");

    pb::DeleteAliasRequest remove;
    remove.set_alias(alias);
    EXPECT_TRUE(unary(*client.collections, &Collections::DeleteAlias, remove).ok());
    expectRefused(unary(*client.collections, &Collections::DeleteAlias, remove), StatusCode::NOT_FOUND,
                  "not_found");
}

}  // namespace
}  // namespace shapedb::testing
