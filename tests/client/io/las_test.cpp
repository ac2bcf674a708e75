// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Las = FileTest;

struct Header {
    int minor = 2;
    std::uint8_t pointFormat = 0;
    std::uint16_t recordSize = 20;
    std::uint32_t count = 1;
    std::uint64_t longCount = 0;
    double scale = 0.5;
    std::uint32_t extra = 0;  ///< bytes between the header and the points
};

std::string las(const Header& h, const std::string& points) {
    const std::uint16_t size = h.minor == 4 ? 375 : h.minor == 3 ? 235 : 227;
    Bytes bytes;
    bytes.text("LASF" + std::string(20, '\0')).add(std::uint8_t{1}).add(static_cast<std::uint8_t>(h.minor));
    bytes.text(std::string(68, ' ')).add(size).add(size + h.extra).add(std::uint32_t{0});
    bytes.add(h.pointFormat).add(h.recordSize).add(h.count).text(std::string(20, '\0'));
    for (int axis = 0; axis < 3; ++axis) bytes.add(h.scale);
    bytes.add(100.0).add(200.0).add(-300.0).text(std::string(48, '\0'));
    if (h.minor == 3) bytes.text(std::string(8, '\0'));
    if (h.minor == 4) bytes.text(std::string(20, '\0')).add(h.longCount).text(std::string(120, '\0'));
    return bytes.str() + std::string(h.extra, 'v') + points;
}

std::string point(std::int32_t x, std::int32_t y, std::int32_t z, std::size_t size = 20) {
    return Bytes().add(x).add(y).add(z).text(std::string(size - 12, 'a')).str();
}

TEST_F(Las, ScalesAndShiftsTheIntegersOfEveryVersion) {
    const PointCloud expected = {{101, 198, -299.5}};
    for (const int minor : {0, 1, 2, 3, 4}) {
        Header h;
        h.minor = minor;
        h.extra = 54;
        h.longCount = 1;
        const Scan scan = readGood("a.las", las(h, point(2, -4, 1)));
        EXPECT_EQ(scan.points, expected) << minor;
        EXPECT_EQ(scan.format, "LAS 1." + std::to_string(minor));
    }
    Header h;
    h.minor = 4;
    h.pointFormat = 6;
    h.recordSize = 34;
    h.count = 0;  // of older readers
    h.longCount = 1;
    EXPECT_EQ(readGood("b.las", las(h, point(2, -4, 1, 34) + "an extended record")).points, expected);
}

TEST_F(Las, DefectsNameTheByte) {
    const Header h;
    expectError("a.las", "LASX" + std::string(300, ' '), kMalformed, {"byte 0", "LASF"});
    expectError("b.las", las(h, "").substr(0, 200), kMalformed, {"ends inside its header"});
    Header two;
    two.count = 2;
    expectError("c.las", las(two, point(1, 2, 3)), kMalformed,
                {"byte 227", "2 points of 20 bytes", "room for 1"});
    expectError("d.las", las(h, point(1, 2, 3) + point(1, 2, 3)), kMalformed,
                {"byte 247", "announced 1 point"});
    Header laz;
    laz.pointFormat = 0x80;
    expectError("e.las", las(laz, point(1, 2, 3)), kMalformed, {"LAZ", "laszip", "pdal"});
    Header small;
    small.recordSize = 11;
    expectError("f.las", las(small, point(1, 2, 3)), kMalformed, {"contradicts"});
    Header zero;
    zero.scale = 0.0;
    expectError("g.las", las(zero, point(1, 2, 3)), kMalformed, {"scale"});
    Header far;
    far.extra = 1000;
    expectError("h.las", las(far, "").substr(0, 300), kMalformed, {"before its points"});
    Header other;
    other.pointFormat = 11;
    expectError("i.las", las(other, point(1, 2, 3)), kMalformed, {"point format 11"});
    Header huge;
    huge.minor = 4;
    huge.longCount = ~std::uint64_t{0};
    expectError("j.las", las(huge, point(1, 2, 3)), kMalformed, {"room for 1"});
}

}  // namespace
}  // namespace shapedb
