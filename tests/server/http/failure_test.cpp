// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/failure.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/http/response.h"
#include "tests/server/http/fields.h"

namespace shapedb::http {
namespace {

// As the Connect protocol has them: written down here apart from the sources.
TEST(Failure, CodesHaveTheNamesAndStatusOfTheProtocol) {
    const std::map<int, std::pair<std::string, unsigned>> expected = {{1, {"canceled", 499}},
                                                                      {2, {"unknown", 500}},
                                                                      {3, {"invalid_argument", 400}},
                                                                      {4, {"deadline_exceeded", 504}},
                                                                      {5, {"not_found", 404}},
                                                                      {6, {"already_exists", 409}},
                                                                      {7, {"permission_denied", 403}},
                                                                      {8, {"resource_exhausted", 429}},
                                                                      {9, {"failed_precondition", 400}},
                                                                      {10, {"aborted", 409}},
                                                                      {11, {"out_of_range", 400}},
                                                                      {12, {"unimplemented", 501}},
                                                                      {13, {"internal", 500}},
                                                                      {14, {"unavailable", 503}},
                                                                      {15, {"data_loss", 500}},
                                                                      {16, {"unauthenticated", 401}}};
    for (const auto& [number, names] : expected) {
        const Code code = codeOfNumber(number);
        EXPECT_EQ(codeName(code), names.first);
        EXPECT_EQ(httpStatusOf(code), names.second) << names.first;
    }
    for (const int unknown : {-1, 0, 17, 1'000}) EXPECT_EQ(codeOfNumber(unknown), Code::kUnknown);
}

TEST(Failure, OfOursKeepsItsNameAndTheCodeThatGrpcGivesIt) {
    const Failure failure = refuse(ErrorCode::kMalformedStream, "why").value();
    EXPECT_EQ(failure.name, "malformed_stream");
    EXPECT_EQ(failure.code, Code::kInvalidArgument);
    EXPECT_EQ(failure.httpStatus(), 400u);
    EXPECT_EQ(refuseWith(415, Code::kInvalidArgument, "why").value().httpStatus(), 415u);
}

TEST(Failure, AsJsonHasTheDetailOfTheApi) {
    Failure failure = refuse(ErrorCode::kQueueFull, "no \"room\"\n").value();
    failure.retryAfter = std::chrono::milliseconds(1'500);
    const nlohmann::json body = nlohmann::json::parse(failureJson(failure));
    EXPECT_EQ(body["code"], "resource_exhausted");
    EXPECT_EQ(body["message"], "no \"room\"\n");
    ASSERT_EQ(body["details"].size(), 1u);
    EXPECT_EQ(body["details"][0]["type"], "shapedb.v1.ErrorDetail");
    EXPECT_EQ(body["details"][0]["value"], "CgpxdWV1ZV9mdWxsENwL") << "protobuf, base64 without padding";
    EXPECT_EQ(body["details"][0]["debug"],
              (nlohmann::json{{"name", "queue_full"}, {"retryAfterMs", "1500"}}));
    EXPECT_FALSE(nlohmann::json::parse(failureJson(refuseWith(404, Code::kUnimplemented, "").value()))
                     .contains("details"));
}

TEST(Failure, AsJsonIsUtf8WhateverItQuotes) {
    const std::string text = failureJson(refuseWith(400, Code::kInvalidArgument, "\xff\xc0\x80").value());
    EXPECT_TRUE(nlohmann::json::accept(text));
}

TEST(Failure, EndsAStreamWithTheTrailers) {
    EXPECT_EQ(endOfStreamJson(nullptr, {}), "{}");
    const Failure failure = refuse(ErrorCode::kNotFound, "gone").value();
    const nlohmann::json end = nlohmann::json::parse(
        endOfStreamJson(&failure, {{"shapedb-error", "not_found"}, {"a", "1"}, {"a", "2"}}));
    EXPECT_EQ(end["error"]["code"], "not_found");
    EXPECT_EQ(end["metadata"], (nlohmann::json{{"a", {"1", "2"}}, {"shapedb-error", {"not_found"}}}));
}

TEST(Failure, AsAnAnswerSaysWhenToTryAgainAndWhatIsWanted) {
    Failure failure = refuse(ErrorCode::kRateLimited, "slow down").value();
    failure.retryAfter = std::chrono::milliseconds(1'001);
    const Response busy = responseOf(failure, {{"shapedb-error", "rate_limited"}, {"odd-bin", "\x01"}});
    EXPECT_EQ(busy.status, 429u);
    EXPECT_EQ(fieldOf(busy, "Retry-After"), "2");
    EXPECT_EQ(fieldOf(busy, "trailer-shapedb-error"), "rate_limited");
    EXPECT_EQ(fieldOf(busy, "trailer-odd-bin"), "");
    EXPECT_EQ(fieldOf(responseOf(refuse(ErrorCode::kUnauthenticated, "").value()), "WWW-Authenticate"),
              "Bearer");
}

TEST(Failure, CannotForgeAField) {
    Response response;
    response.fields = {{"Good", "a b"}, {"Bad", "x\r\nSet-Cookie: y"}, {"Bad", std::string("\0", 1)}};
    const std::string head = headText(response, {"Content-Length: 0"});
    EXPECT_EQ(head.substr(0, 17), "HTTP/1.1 200 OK\r\n");
    EXPECT_NE(head.find("Good: a b\r\n"), std::string::npos);
    EXPECT_EQ(head.find("Bad"), std::string::npos);
    EXPECT_EQ(head.find("Cookie"), std::string::npos);
    EXPECT_EQ(head.substr(head.size() - 4), "\r\n\r\n");
}

}  // namespace
}  // namespace shapedb::http
