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

TEST_F(AuditLogTest, AFloodOfRefusalsIsCountedNotWritten) {
    const auto opened = AuditLog::open(path_, log_);
    ASSERT_TRUE(opened);
    AuditLog& audit = **opened;
    // Far more than the seconds this takes allow.
    constexpr int kFlood = 10'000;
    for (int i = 0; i < kFlood; ++i) audit.recordRefusal({{"i", std::int64_t{i}}});
    audit.recordAdministration({{"rpc", std::string("Backup")}});
    const std::size_t flooded = lines().size();
    EXPECT_LT(flooded, 1'000u);
    EXPECT_EQ(lines("audit.log").back()["rpc"], "Backup") << "administration is never left out";
    ASSERT_TRUE(testing::eventually([&] {
        audit.recordRefusal({{"late", true}});
        return lines().back().contains("left_out") || lines().size() > flooded + 1;
    }));
    std::uint64_t told = 0, refusals = 0;
    for (const auto& line : lines()) {
        if (line.contains("left_out")) told += line["left_out"].get<std::uint64_t>();
        if (line["message"] == "refused" && line.contains("i")) ++refusals;
    }
    EXPECT_GE(told + refusals, static_cast<std::uint64_t>(kFlood)) << "each is written or counted";
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
