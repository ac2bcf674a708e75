// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/command_line.h"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/config/settings.h"

namespace shapedb::config {
namespace {

using ::testing::HasSubstr;

TEST(ManPage, HasEverySetting) {
    const std::string page = manPage();
    for (const Setting& setting : settings()) {
        EXPECT_THAT(page, HasSubstr("File: " + setting.key + ". Environment: " + setting.environment + "."));
    }
    EXPECT_THAT(page, HasSubstr(".BI \\-\\-ingest\\-max\\-queued\\-jobs \" VALUE\""));
    EXPECT_THAT(page, HasSubstr("default: 127.0.0.1:7878"));
}

/// A line that began with a dot would be a request that man does not know, and vanish.
TEST(ManPage, HasNoOtherRequestsThanThoseOfMan) {
    std::istringstream lines(manPage());
    for (std::string line; std::getline(lines, line);) {
        ASSERT_FALSE(line.empty());
        if (line[0] != '.') continue;
        EXPECT_THAT(line.substr(0, line.find(' ')), ::testing::AnyOf(".TH", ".SH", ".TP", ".PP", ".B", ".BI",
                                                                     ".BR", ".RB", ".IR", ".I", ".br"));
    }
}

}  // namespace
}  // namespace shapedb::config
