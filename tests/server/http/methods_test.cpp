// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/methods.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/shape_service.pb.h"

namespace shapedb::http {
namespace {

const Methods& methods() {
    static const Methods all;
    return all;
}

const Method& method(const std::string& name) { return *methods().find("/shapedb.v1." + name); }

TEST(Methods, AreThoseOfTheApi) {
    const Method* get = methods().find("/shapedb.v1.ShapeService/GetShape");
    ASSERT_NE(get, nullptr);
    EXPECT_EQ(get->requestType, "shapedb.v1.GetShapeRequest");
    EXPECT_FALSE(get->streams());
    EXPECT_TRUE(method("ShapeService/AddShape").clientStreams);
    EXPECT_FALSE(method("ShapeService/AddShape").serverStreams);
    EXPECT_TRUE(method("ShapeService/WatchIngest").serverStreams);
    EXPECT_TRUE(method("AdminService/Rebuild").serverStreams);
    for (const char* none :
         {"/shapedb.v1.ShapeService/Nothing", "/shapedb.v1.ShapeService/", "/shapedb.v1.X/GetShape",
          "/grpc.health.v1.Health/Check", "", "/", "//shapedb.v1.ShapeService/GetShape"}) {
        EXPECT_EQ(methods().find(none), nullptr) << none;
    }
    EXPECT_TRUE(Methods::isCall("/shapedb.v1.X/Y"));
    EXPECT_FALSE(Methods::isCall("/shapedb.v2.X/Y"));
}

TEST(Methods, RequestsComeAsJson) {
    const auto bytes = methods().requestFromJson(
        method("ShapeService/AddShape"),
        R"({"header": {"key": "a", "pointCount": "5", "metadata": {"label": "cup"}, "mode": "ADD_MODE_UPSERT"}})");
    ASSERT_TRUE(bytes) << bytes.error().message;
    v1::AddShapeRequest request;
    ASSERT_TRUE(request.ParseFromString(*bytes));
    EXPECT_EQ(request.header().key(), "a");
    EXPECT_EQ(request.header().point_count(), 5u);
    EXPECT_EQ(request.header().metadata().at("label"), "cup");
    const auto chunk =
        methods().requestFromJson(method("ShapeService/AddShape"), R"({"chunk": {"xyz": "AAECAw=="}})");
    ASSERT_TRUE(chunk);
    ASSERT_TRUE(request.ParseFromString(*chunk));
    EXPECT_EQ(request.chunk().xyz(), std::string("\0\1\2\3", 4));
}

TEST(Methods, OtherTextIsRefusedWithThePlace) {
    const Method& search = method("SearchService/SearchByKey");
    for (const char* bad : {"", " ", "{", "[]", "1", "null", "{\"key\": 1", "{\"kex\": \"a\"}",
                            "{\"key\": {}}", "{\"options\": {\"k\": \"x\"}}", "{\"options\": {\"k\": -1}}",
                            "{\"options\": {\"k\": 1e99}}", "{\"key\": \"\xff\"}", "{\"key\": \"a\"} x"}) {
        const auto bytes = methods().requestFromJson(search, bad);
        ASSERT_FALSE(bytes) << bad;
        EXPECT_EQ(bytes.error().code, Code::kInvalidArgument) << bad;
        EXPECT_EQ(bytes.error().name, "invalid_argument");
        EXPECT_FALSE(bytes.error().message.empty());
    }
    const auto unknown = methods().requestFromJson(search, R"({"options": {"kk": 3}})");
    ASSERT_FALSE(unknown);
    EXPECT_NE(unknown.error().message.find("kk"), std::string::npos) << unknown.error().message;
}

TEST(Methods, DeepNestingDoesNotExhaustTheStack) {
    std::string deep;
    for (int i = 0; i < 1'000'000; ++i) deep += "{\"a\":";
    EXPECT_FALSE(methods().requestFromJson(method("SearchService/SearchByKey"), deep));
    EXPECT_FALSE(methods().requestFromJson(method("SearchService/SearchByKey"), std::string(1'000'000, '[')));
    // Where texts end and lists begin is as protobuf has it, which takes both kinds of quotes.
    const std::string lists(33, '[');
    for (const std::string begin : {"", "{\"key\": ", "{'\"': ", "{'\\'\"': ", "{\"\\\"'\": "}) {
        const auto refused = methods().requestFromJson(method("SearchService/SearchByKey"), begin + lists);
        ASSERT_FALSE(refused) << begin;
        EXPECT_NE(refused.error().message.find("nests more than 32 deep"), std::string::npos) << begin;
    }
    EXPECT_TRUE(methods().requestFromJson(method("SearchService/SearchByKey"),
                                          R"({"key": "\"'[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["})"));
}

TEST(Methods, AnswersAreCanonicalJson) {
    v1::CountShapesResponse count;
    count.set_count(12);
    const auto json = methods().responseToJson(method("ShapeService/CountShapes"), count.SerializeAsString());
    ASSERT_TRUE(json);
    EXPECT_EQ(nlohmann::json::parse(*json), (nlohmann::json{{"count", "12"}})) << "64 bits are text";
    EXPECT_EQ(*methods().responseToJson(method("ShapeService/CountShapes"), ""), "{}");
}

TEST(Methods, BothFormsMeanTheSame) {
    v1::StoredPoints points;
    points.mutable_chunk()->set_xyz(std::string("\x00\xff\x7f\x80", 4));
    const auto json = methods().responseToJson(method("ShapeService/GetPoints"), points.SerializeAsString());
    ASSERT_TRUE(json);
    EXPECT_EQ(nlohmann::json::parse(*json)["chunk"]["xyz"], "AP9/gA==");
}

}  // namespace
}  // namespace shapedb::http
