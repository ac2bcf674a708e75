// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/audit_log.h"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/eventually.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::telemetry {
namespace {

class AuditLogTest : public ::testing::Test {
  protected:
    std::vector<nlohmann::json> lines(const std::string& name = "audit.refused.log") const {
        std::ifstream stream(directory_.path() + "/" + name);
        std::vector<nlohmann::json> all;
        for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
        return all;
    }
    LoggerPtr log_ = makeLogger({}).value();
    testing::TemporaryDirectory directory_;
    std::string path_ = directory_.path() + "/audit.log";
};

TEST_F(AuditLogTest, WritesOneObjectPerLineForItsOwnerOnly) {
    const auto previous = ::umask(0);
    const auto opened = AuditLog::open(path_, log_);
    ::umask(previous);
    ASSERT_TRUE(opened);
    (*opened)->recordAdministration({{"rpc", std::string("Restore")}});
    (*opened)->recordRefusal({{"rpc", std::string("Stats")}, {"reason", std::string("a\nb")}});
    const auto done = lines("audit.log"), refused = lines();
    ASSERT_EQ(done.size(), 1u);
    EXPECT_EQ(done[0]["message"], "administration");
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_EQ(refused[0]["message"], "refused");
    EXPECT_EQ(refused[0]["reason"], "a\nb");
    struct stat status {};
    ASSERT_EQ(::stat(path_.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(AuditLogTest, AFloodOfRefusalsIsCountedForEachAddressAndKey) {
    auto opened = AuditLog::open(path_, log_);
    ASSERT_TRUE(opened);
    AuditLog& audit = **opened;
    constexpr std::uint64_t kFlood = 10'000, kSome = 7;
    const auto refuse = [&](const std::string& peer, const std::string& caller) {
        std::vector<Field> call = {{"rpc", std::string("Stats")}, {"peer", peer}};
        if (!caller.empty()) call.push_back({"caller", caller});
        audit.recordRefusal(std::move(call));
    };
    const auto port = [](std::uint64_t i) { return ":" + std::to_string(40'000 + i % 1'000); };
    for (std::uint64_t i = 0; i < kFlood; ++i) refuse("ipv4:192.0.2.1" + port(i), "");
    for (std::uint64_t i = 0; i < kSome; ++i) refuse("ipv6:%5B2001:db8::1%5D" + port(i), "0123abcd");
    audit.recordAdministration({{"rpc", std::string("Backup")}});
    EXPECT_EQ(lines("audit.log").back()["rpc"], "Backup") << "administration is never left out";
    const std::uint64_t written = lines().size();
    EXPECT_GE(written, std::uint64_t{AuditLog::kRefusalBurst});
    EXPECT_LE(written, std::uint64_t{AuditLog::kRefusalBurst} + 10) << "whatever the machine is doing";
    audit.summarize();
    audit.summarize();
    ASSERT_EQ(lines().size(), written + 1) << "one line, once";
    const auto told = lines().back();
    EXPECT_EQ(told["left_out"].get<std::uint64_t>() + written, kFlood + kSome)
        << "each is written or counted";
    const std::string of = told["of"].get<std::string>();
    EXPECT_EQ(of.rfind("ipv4:192.0.2.1: ", 0), 0u) << of;
    EXPECT_NE(of.find("; ipv6:%5B2001:db8::1%5D key 0123abcd: 7"), std::string::npos) << of;
}

TEST_F(AuditLogTest, FloodsFromEverywhereAreOneLineOfBoundedLength) {
    auto opened = AuditLog::open(path_, log_);
    ASSERT_TRUE(opened);
    for (int i = 0; i < 5'000; ++i) {
        (*opened)->recordRefusal(
            {{"peer", "ipv4:10.0." + std::to_string(i % 250) + ".1:1"}, {"key", std::string(2'000, 'k')}});
    }
    for (const auto& line : lines()) EXPECT_LE(line.dump().size(), 600u);
    opened->reset();
    const auto told = lines().back();
    EXPECT_GT(told["left_out"].get<int>(), 4'000) << "also at the end of the server";
    EXPECT_NE(told["of"].get<std::string>().find("others: "), std::string::npos) << told;
    EXPECT_LE(told.dump().size(), 1'300u);
}

TEST_F(AuditLogTest, IsRefusedWhereItCannotBeOpenedAndThroughLinks) {
    EXPECT_EQ(AuditLog::open("/dev/null/audit.log", log_).error().code, ErrorCode::kFileNotWritable);
    ASSERT_EQ(::symlink("elsewhere", path_.c_str()), 0);
    EXPECT_EQ(AuditLog::open(path_, log_).error().code, ErrorCode::kFileNotWritable);
    EXPECT_NE(::access((directory_.path() + "/elsewhere").c_str(), F_OK), 0);
}

TEST_F(AuditLogTest, OneCallCannotFillIt) {
    const auto opened = AuditLog::open(path_, log_);
    ASSERT_TRUE(opened);
    (*opened)->recordAdministration({{"key", std::string(std::size_t{4} << 20, 'A')}});
    EXPECT_LE(lines("audit.log")[0]["key"].get<std::string>().size(), 2'048u);
}

}  // namespace
}  // namespace shapedb::telemetry
