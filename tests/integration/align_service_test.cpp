// SPDX-License-Identifier: GPL-3.0-or-later
// AlignService on a live server.
#include <cmath>

#include "core/geometry/motion.h"
#include "core/synthetic/degrade.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

class AlignRpc : public LiveTest {
  protected:
    Reply<pb::AlignResponse> align(const pb::AlignHeader& header, const std::vector<Scan>& scans) {
        CallContext context;
        Reply<pb::AlignResponse> reply;
        const auto writer = client.aligns->Align(&context, &reply.value);
        pb::AlignRequest message;
        *message.mutable_header() = header;
        bool open = writer->Write(message);
        for (const Scan& scan : scans) {
            for (const std::string& chunk : chunksOf(scan, 700)) {
                message.mutable_chunk()->set_xyz(chunk);
                open = open && writer->Write(message);
            }
        }
        writer->WritesDone();
        static_cast<Outcome&>(reply) = context.outcome(writer->Finish());
        return reply;
    }

    static pb::AlignHeader headerOf(const Scan& query) {
        pb::AlignHeader header;
        header.set_query_points(query.size() / 3);
        header.set_query_sha256(sha256Of(query));
        return header;
    }
};

Scan moved(const Scan& scan) {
    Motion motion;
    motion.scale = 2.5;
    motion.rotation = {{{0.0, -1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}};
    motion.translation = {3.0, -1.0, 0.5};
    return pack(applyToCloud(motion, unpack(scan)));
}

TEST_F(AlignRpc, FindsTheMotionBetweenTwoScans) {
    const Scan other = familyScan("hammer", 1);
    const Scan query = moved(other);
    pb::AlignHeader header = headerOf(query);
    header.set_other_points(other.size() / 3);
    header.set_other_sha256(sha256Of(other));
    header.set_forbid_reflection(true);
    const auto found = align(header, {query, other});
    ASSERT_TRUE(found.ok()) << found;
    const pb::FitPose& best = found.value.fit().best();
    EXPECT_GT(best.score(), 0.9);
    EXPECT_NEAR(best.motion().scale(), 2.5, 0.05);
    EXPECT_FALSE(best.motion().reflected());
    header.set_keep_scale(true);
    const auto kept = align(header, {query, other});
    ASSERT_TRUE(kept.ok());
    EXPECT_EQ(kept.value.fit().best().motion().scale(), 1.0);
    EXPECT_LT(kept.value.fit().best().score(), 0.8);
}

TEST_F(AlignRpc, LaysAStoredShapeOnAScan) {
    const Scan stored = familyScan("hammer", 1);
    ASSERT_TRUE(addAndWait(client, collection, "hammer", stored).ok());
    const Scan query = moved(familyScan("hammer", 1, 9));
    pb::AlignHeader header = headerOf(query);
    header.mutable_key()->set_collection(collection);
    header.mutable_key()->set_key("hammer");
    const auto found = align(header, {query});
    ASSERT_TRUE(found.ok()) << found;
    EXPECT_GT(found.value.fit().best().score(), 0.8);
    header.mutable_key()->set_key("absent");
    EXPECT_EQ(align(header, {query}).error, "not_found");
}

TEST_F(AlignRpc, LeavesOutTheTableThatAScanStandsOn) {
    const PointCloud alone = unpack(familyScan("hammer", 1));
    PointCloud points = alone;
    addTable(points, alone.size() / 2, 2.5, 0.0, 1);
    const Scan onTable = pack(points);
    const Scan other = pack(alone);
    pb::AlignHeader header = headerOf(onTable);
    header.set_other_points(other.size() / 3);
    const auto with = align(header, {onTable, other});
    ASSERT_TRUE(with.ok()) << with;
    EXPECT_LT(with.value.fit().best().score(), 0.8);
    header.mutable_query_isolation()->set_drop_plane(true);
    const auto without = align(header, {onTable, other});
    ASSERT_TRUE(without.ok()) << without;
    EXPECT_GT(without.value.fit().best().score(), 0.9);

    pb::AlignHeader turned = headerOf(other);
    turned.set_other_points(onTable.size() / 3);
    turned.mutable_other_isolation()->set_largest_object(true);
    EXPECT_GT(align(turned, {other, onTable}).value.fit().best().score(), 0.9);
}

TEST_F(AlignRpc, NamesTheScanThatIsWrong) {
    const Scan scan = familyScan("hammer", 1);
    pb::AlignHeader header = headerOf(scan);
    EXPECT_EQ(align(header, {scan}).error, "invalid_argument") << "nothing to lay on it";
    header.set_other_points(scan.size() / 3);
    CallContext context;
    pb::AlignResponse none;
    const auto empty = client.aligns->Align(&context, &none);
    empty->WritesDone();
    EXPECT_EQ(context.outcome(empty->Finish()).error, "malformed_stream") << "no message at all";
    const auto missing = align(header, {scan});
    EXPECT_EQ(missing.error, "count_mismatch") << missing;
    EXPECT_NE(missing.status.error_message().find("other: "), std::string::npos) << missing;
    header.set_other_sha256(std::string(32, 'x'));
    EXPECT_EQ(align(header, {scan, scan}).error, "checksum_mismatch");
    header.set_query_points(3);
    EXPECT_EQ(align(header, {scan, scan}).error, "too_few_points");
    Scan broken = scan;
    broken[4] = std::nanf("");
    pb::AlignHeader both = headerOf(broken);
    both.set_other_points(scan.size() / 3);
    EXPECT_EQ(align(both, {broken, scan}).error, "non_finite_coordinate");
}

}  // namespace
}  // namespace shapedb::testing
