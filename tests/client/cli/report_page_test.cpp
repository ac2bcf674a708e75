// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/report_page.h"

#include <regex>

#include <gtest/gtest.h>

namespace shapedb::cli {
namespace {

ReportPage examplePage() {
    ReportPage page;
    page.title = "Shapes like <b>a & b</b>";
    page.about = "52 shapes searched";
    page.queryName = "a.ply";
    for (int i = 0; i < 100; ++i) page.query.push_back({1e6 + 0.01 * i, 2e6 - 0.02 * i, 0.01 * (i % 10)});
    ReportHit hit;
    hit.key = "mug/\"><script>alert(1)</script>";
    hit.label = "mug";
    hit.score = 0.75;
    hit.verdict = "same object";
    hit.why = "first line\nsecond line\n";
    hit.bars = {{"chords", 0.5, "0.11"}, {"fit", 1.7, "0"}};
    hit.points = page.query;
    page.hits = {hit, hit};
    return page;
}

TEST(ReportPage, AsksTheNetworkForNothing) {
    const std::string html = reportHtml(examplePage());
    for (const char* word :
         {"http:", "https:", "//cdn", "src=", "href=", "@import", "url(", "fetch(", "XMLHttp"}) {
        EXPECT_EQ(html.find(word), std::string::npos) << word;
    }
    EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
}

TEST(ReportPage, EscapesWordsOfStrangers) {
    const std::string html = reportHtml(examplePage());
    EXPECT_EQ(html.find("alert(1)</script>"), std::string::npos);
    EXPECT_NE(html.find("mug/&quot;&gt;&lt;script&gt;"), std::string::npos);
    EXPECT_EQ(html.find("<b>a"), std::string::npos);
    std::size_t scripts = 0;
    for (std::size_t at = 0; (at = html.find("<script", at)) != std::string::npos; ++at) ++scripts;
    EXPECT_EQ(scripts, 1u);
}

TEST(ReportPage, HasTheReasonsWithoutItsScript) {
    const std::string html = reportHtml(examplePage());
    for (const char* words : {"1. mug", "0.750", "same object", "first line\nsecond line", "chords",
                              "width:50.0%", "width:100.0%", "52 shapes searched"}) {
        EXPECT_NE(html.find(words), std::string::npos) << words;
    }
    EXPECT_NE(reportHtml({"t", "a", "q", {}, {}}).find("Nothing found"), std::string::npos);
}

TEST(ReportPage, HasPointsWhereverTheyLie) {
    const std::string html = reportHtml(examplePage());
    const std::regex attribute("data-points=\"([A-Za-z0-9+/=]*)\"");
    std::size_t clouds = 0;
    for (auto at = std::sregex_iterator(html.begin(), html.end(), attribute); at != std::sregex_iterator();
         ++at) {
        // 100 points of 6 bytes.
        EXPECT_EQ((*at)[1].length(), 800);
        ++clouds;
    }
    EXPECT_EQ(clouds, 3u);
    ReportPage large = examplePage();
    large.hits.clear();
    for (int i = 0; i < 100'000; ++i) large.query.push_back({1e6 + 1e-5 * i, 2e6, 0.0});
    EXPECT_LT(reportHtml(large).size(), 200'000u) << "of many points a subset";
}

}  // namespace
}  // namespace shapedb::cli
