#include "server/telemetry/audit_log.h"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "tests/support/eventually.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::telemetry {
namespace {

class AuditLogTest : public ::testing::Test {
  protected:
    std::vector<nlohmann::json> lines() const {
        std::ifstream stream(path_);
        std::vector<nlohmann::json> all;
        for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
        return all;
    }
    testing::TemporaryDirectory directory_;
    std::string path_ = directory_.path() + "/audit.log";
};

TEST_F(AuditLogTest, WritesOneObjectPerLineForItsOwnerOnly) {
    const auto previous = ::umask(0);
    const auto file = AuditLog::openFile(path_);
    ::umask(previous);
    ASSERT_TRUE(file);
    AuditLog audit(*file);
    audit.recordAdministration({{"rpc", std::string("Restore")}});
    audit.recordRefusal({{"rpc", std::string("Stats")}, {"reason", std::string("a\nb")}});
    const auto written = lines();
    ASSERT_EQ(written.size(), 2u);
    EXPECT_EQ(written[0]["message"], "administration");
    EXPECT_EQ(written[1]["message"], "refused");
    EXPECT_EQ(written[1]["reason"], "a\nb");
    struct stat status {};
    ASSERT_EQ(::stat(path_.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(AuditLogTest, AFloodOfRefusalsIsCountedNotWritten) {
    AuditLog audit(AuditLog::openFile(path_).value());
    // Far more than the seconds this takes allow.
    constexpr int kFlood = 10'000;
    for (int i = 0; i < kFlood; ++i) audit.recordRefusal({{"i", std::int64_t{i}}});
    audit.recordAdministration({{"rpc", std::string("Backup")}});
    const std::size_t flooded = lines().size();
    EXPECT_LT(flooded, 1'000u);
    EXPECT_EQ(lines().back()["rpc"], "Backup") << "administration is never left out";
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

TEST_F(AuditLogTest, CannotBeOpenedInAFolderThatIsNotThere) {
    EXPECT_EQ(AuditLog::openFile("/dev/null/audit.log").error().code, ErrorCode::kFileNotWritable);
}

}  // namespace
}  // namespace shapedb::telemetry
