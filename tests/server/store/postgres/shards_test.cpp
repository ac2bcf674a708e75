// SPDX-License-Identifier: GPL-3.0-or-later
// The database puts each shape into the shard that the servers put it into.
#include <limits>
#include <string>
#include <vector>

#include "server/cluster/shard.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class PostgresShardsTest : public StoreTest {
  protected:
    Engine engine() const override { return Engine::kPostgres; }

    /// Pairs of an id and the shard that the database gives it.
    void expectShards(const char* sql, const std::string& ids, std::size_t count) {
        PostgresConnection connection({database_, {}, std::chrono::seconds(60), "test"}, none_);
        Query query(connection, sql, ids);
        std::size_t found = 0;
        for (; query.step(); ++found) {
            ASSERT_EQ(query.integer(1), cluster::shardOf(query.integer(0))) << "id " << query.integer(0);
        }
        EXPECT_EQ(found, count);
    }

    const StatementTexts none_;
};

TEST_F(PostgresShardsTest, AreThoseOfTheServers) {
    constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    constexpr std::int64_t kHalf = std::int64_t{1} << 32;
    std::vector<std::int64_t> ids = {kLeast, kLeast + 1, -kHalf,    1 - kHalf, kHalf - 1,
                                     kHalf,  kMost,      kMost - 1, -1,        0};
    while (ids.size() < 5'000) ids.push_back(static_cast<std::int64_t>(ids.size()));
    Random random(17);
    while (ids.size() < 10'000) ids.push_back(static_cast<std::int64_t>(random.next()));
    std::string list;
    for (const std::int64_t id : ids) list += (list.empty() ? "" : ",") + std::to_string(id);
    expectShards("SELECT id, shard_of(id) FROM unnest(string_to_array(?1, ',')::bigint[]) id", list,
                 ids.size());
}

TEST_F(PostgresShardsTest, EveryShapeHasItsOwn) {
    const Collection c = collection();
    for (int i = 0; i < 50; ++i) put(c.id, "k" + std::to_string(i), 1);
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    const auto restored = store_->restore(backup, {}, {});
    ASSERT_TRUE(restored) << restored.error().message;
    expectShards("SELECT id, shard FROM shape WHERE key <> ?1", "none", 50);
}

}  // namespace
}  // namespace shapedb::store
