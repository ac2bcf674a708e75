// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/status.h"

#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "common/safe_text.h"

namespace shapedb::rpc {
namespace {

using grpc::StatusCode;

// The table of docs/api.md, by name; a new error belongs in both.
const std::map<std::string, StatusCode> kTable = {
    {"non_finite_coordinate", StatusCode::INVALID_ARGUMENT},
    {"coordinate_out_of_range", StatusCode::INVALID_ARGUMENT},
    {"too_few_points", StatusCode::INVALID_ARGUMENT},
    {"all_points_equal", StatusCode::INVALID_ARGUMENT},
    {"collinear", StatusCode::INVALID_ARGUMENT},
    {"coplanar", StatusCode::INVALID_ARGUMENT},
    {"no_interior", StatusCode::INVALID_ARGUMENT},
    {"point_limit_exceeded", StatusCode::OUT_OF_RANGE},
    {"file_not_readable", StatusCode::INTERNAL},
    {"unknown_file_format", StatusCode::INVALID_ARGUMENT},
    {"malformed_file", StatusCode::INVALID_ARGUMENT},
    {"file_not_writable", StatusCode::INTERNAL},
    {"invalid_argument", StatusCode::INVALID_ARGUMENT},
    {"malformed_filter", StatusCode::INVALID_ARGUMENT},
    {"malformed_cursor", StatusCode::INVALID_ARGUMENT},
    {"malformed_signature", StatusCode::INVALID_ARGUMENT},
    {"malformed_stream", StatusCode::INVALID_ARGUMENT},
    {"checksum_mismatch", StatusCode::INVALID_ARGUMENT},
    {"count_mismatch", StatusCode::INVALID_ARGUMENT},
    {"not_found", StatusCode::NOT_FOUND},
    {"already_exists", StatusCode::ALREADY_EXISTS},
    {"version_conflict", StatusCode::ABORTED},
    {"not_ready", StatusCode::FAILED_PRECONDITION},
    {"rejected", StatusCode::FAILED_PRECONDITION},
    {"unauthenticated", StatusCode::UNAUTHENTICATED},
    {"permission_denied", StatusCode::PERMISSION_DENIED},
    {"rate_limited", StatusCode::RESOURCE_EXHAUSTED},
    {"queue_full", StatusCode::RESOURCE_EXHAUSTED},
    {"unavailable", StatusCode::UNAVAILABLE},
    {"cancelled", StatusCode::CANCELLED},
    {"deadline_exceeded", StatusCode::DEADLINE_EXCEEDED},
    {"out_of_memory", StatusCode::RESOURCE_EXHAUSTED},
    {"storage", StatusCode::INTERNAL},
    {"storage_full", StatusCode::RESOURCE_EXHAUSTED},
    {"data_loss", StatusCode::DATA_LOSS},
    {"schema_too_new", StatusCode::FAILED_PRECONDITION},
    {"internal", StatusCode::INTERNAL},
};

TEST(StatusCodeOf, EveryErrorHasItsCode) {
    EXPECT_EQ(kTable.size(), static_cast<std::size_t>(ErrorCode::kInternal) + 1);
    for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i) {
        const auto code = static_cast<ErrorCode>(i);
        const auto row = kTable.find(errorCodeName(code));
        ASSERT_NE(row, kTable.end()) << errorCodeName(code);
        EXPECT_EQ(statusCodeOf(code), row->second) << row->first;
    }
}

const char* nameOf(StatusCode code) {
    static const std::map<StatusCode, const char*> kNames = {
        {StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT"},
        {StatusCode::OUT_OF_RANGE, "OUT_OF_RANGE"},
        {StatusCode::NOT_FOUND, "NOT_FOUND"},
        {StatusCode::ALREADY_EXISTS, "ALREADY_EXISTS"},
        {StatusCode::ABORTED, "ABORTED"},
        {StatusCode::FAILED_PRECONDITION, "FAILED_PRECONDITION"},
        {StatusCode::UNAUTHENTICATED, "UNAUTHENTICATED"},
        {StatusCode::PERMISSION_DENIED, "PERMISSION_DENIED"},
        {StatusCode::RESOURCE_EXHAUSTED, "RESOURCE_EXHAUSTED"},
        {StatusCode::UNAVAILABLE, "UNAVAILABLE"},
        {StatusCode::CANCELLED, "CANCELLED"},
        {StatusCode::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"},
        {StatusCode::DATA_LOSS, "DATA_LOSS"},
        {StatusCode::INTERNAL, "INTERNAL"}};
    return kNames.at(code);
}

// docs/api.md agrees.
TEST(StatusCodeOf, PageListsEveryErrorWithItsCode) {
    std::ifstream page(SHAPEDB_API_PAGE);
    std::map<std::string, std::string> codes;
    for (std::string line; std::getline(page, line);) {
        const std::size_t second = line.find(" | ");
        if (line.rfind("| `", 0) != 0 || second == std::string::npos) continue;
        const std::string code = line.substr(second + 3, line.find(" | ", second + 3) - second - 3);
        for (std::size_t at = line.find('`'); at < second; at = line.find('`', at + 1)) {
            const std::size_t end = line.find('`', at + 1);
            codes[line.substr(at + 1, end - at - 1)] = code;
            at = end;
        }
    }
    for (const auto& [name, code] : kTable) {
        ASSERT_EQ(codes.count(name), 1u) << name;
        EXPECT_EQ(codes[name], nameOf(code)) << name;
    }
}

TEST(MakeStatus, CarriesCodeAndMessage) {
    grpc::ServerContext context;
    const grpc::Status status = makeStatus({ErrorCode::kVersionConflict, "version is 3"}, context);
    EXPECT_EQ(status.error_code(), StatusCode::ABORTED);
    EXPECT_EQ(status.error_message(), "version is 3");
}

TEST(MakeStatus, CutsLongMessages) {
    grpc::ServerContext context;
    EXPECT_EQ(makeStatus({ErrorCode::kInternal, std::string(10'000, 'x')}, context).error_message().size(),
              2'048u);
}

TEST(CutText, KeepsCharactersWhole) {
    const std::string text = "aé€𝄞";  // 1, 2, 3 and 4 bytes
    const std::map<std::size_t, std::string> expected = {{0, ""},    {1, "a"},   {2, "a"},   {3, "aé"},
                                                         {4, "aé"},  {5, "aé"},  {6, "aé€"}, {7, "aé€"},
                                                         {8, "aé€"}, {9, "aé€"}, {10, text}, {11, text}};
    for (const auto& [limit, cut] : expected) EXPECT_EQ(cutText(text, limit), cut) << limit;
}

}  // namespace
}  // namespace shapedb::rpc
