// SPDX-License-Identifier: Apache-2.0
// LAS 1.0 to 1.4, uncompressed. Debian 12 has neither PDAL nor LASzip; LAZ, the compressed kind, is refused
// with the way out.
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "client/io/formats.h"
#include "client/io/scalar.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

// Places in the header, in bytes.
constexpr std::uint64_t kVersionAt = 24;
constexpr std::uint64_t kHeaderSizeAt = 94;
constexpr std::uint64_t kPointsAt = 96;
constexpr std::uint64_t kPointFormatAt = 104;
constexpr std::uint64_t kRecordSizeAt = 105;
constexpr std::uint64_t kCountAt = 107;
constexpr std::uint64_t kScaleAt = 131;
constexpr std::uint64_t kShiftAt = 155;
constexpr std::uint64_t kLeastHeader = 227;
constexpr std::uint64_t kLongCountAt = 247;  // since 1.4
constexpr std::uint64_t kLongHeader = 375;

// x, y and z of every point format, as integers.
constexpr std::uint64_t kLeastRecord = 12;
constexpr unsigned kCompressed = 0xc0;  // flags in the point format of LAZ
constexpr unsigned kLastPointFormat = 10;

class LasReader {
  public:
    LasReader(InputFile& file, std::size_t maxPoints)
        : file_(file), sink_(file, content_.vertices, maxPoints) {}

    Result<ScanContent> read() {
        RETURN_IF_ERROR(readHeader());
        RETURN_IF_ERROR(readPoints());
        content_.format = "LAS " + std::to_string(major_) + "." + std::to_string(minor_);
        return std::move(content_);
    }

  private:
    template <typename T>
    T load(std::uint64_t at) const {
        return loadAs<T>(file_.data() + at, !machineIsLittleEndian());
    }

    Result<void> readHeader() {
        if (!file_.fill(4) || std::string_view(file_.data(), 4) != "LASF") {
            return fail(file_.malformed("byte 0: expected 'LASF'; this is not a LAS file"));
        }
        if (!file_.fill(kLeastHeader)) return fail(file_.malformed("the file ends inside its header"));
        major_ = load<std::uint8_t>(kVersionAt);
        minor_ = load<std::uint8_t>(kVersionAt + 1);
        const unsigned pointFormat = load<std::uint8_t>(kPointFormatAt);
        if ((pointFormat & kCompressed) != 0) {
            return fail(
                file_.malformed("the points are compressed (LAZ), which is not read; unpack the file with "
                                "'laszip -i IN.laz -o OUT.las' or 'pdal translate IN.laz OUT.las'"));
        }
        if (major_ != 1 || minor_ > 4 || pointFormat > kLastPointFormat) {
            return fail(file_.malformedByte(kVersionAt,
                                            "LAS " + std::to_string(major_) + "." + std::to_string(minor_) +
                                                " with point format " + std::to_string(pointFormat) +
                                                " is not read, only 1.0 to 1.4 with formats 0 to 10"));
        }
        recordSize_ = load<std::uint16_t>(kRecordSizeAt);
        count_ = load<std::uint32_t>(kCountAt);
        const std::uint64_t headerSize = load<std::uint16_t>(kHeaderSizeAt);
        if (minor_ == 4 && headerSize >= kLongHeader && file_.fill(kLongHeader)) {
            count_ = load<std::uint64_t>(kLongCountAt);
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            scale_[axis] = load<double>(kScaleAt + 8 * axis);
            shift_[axis] = load<double>(kShiftAt + 8 * axis);
            if (!std::isfinite(scale_[axis]) || !std::isfinite(shift_[axis]) || scale_[axis] == 0.0) {
                return fail(
                    file_.malformedByte(kScaleAt, "the scale or offset of the coordinates is not a number"));
            }
        }
        const std::uint64_t points = load<std::uint32_t>(kPointsAt);
        if (recordSize_ < kLeastRecord || points < kLeastHeader || points < headerSize) {
            return fail(file_.malformedByte(kPointsAt, "the header contradicts itself: points of " +
                                                           countText(recordSize_, "byte") + " at byte " +
                                                           std::to_string(points)));
        }
        if (!file_.skip(points)) return fail(file_.malformed("the file ends before its points"));
        return {};
    }

    Result<void> readPoints() {
        if (const auto left = file_.remaining()) {
            if (count_ > *left / recordSize_) {
                return fail(file_.malformedByte(
                    file_.offset(), "the header announces " + countText(count_, "point") + " of " +
                                        countText(recordSize_, "byte") + ", but the file has room for " +
                                        std::to_string(*left / recordSize_)));
            }
            sink_.reserve(count_);
        }
        const std::uint64_t start = file_.offset();
        Point3 p;
        const std::uint64_t done = visitRecords(file_, count_, recordSize_, [&](const char* record, auto) {
            p = {coordinate(record, 0), coordinate(record, 1), coordinate(record, 2)};
            return sink_.add(p);
        });
        const std::uint64_t place = start + done * recordSize_;
        if (done < count_) {
            if (file_.fill(recordSize_)) return fail(sink_.refusal(p, "byte " + std::to_string(place)));
            return fail(file_.malformedByte(place, "the file ends inside point " + std::to_string(done) +
                                                       " of " + std::to_string(count_)));
        }
        // Since 1.3 wave forms and other records may follow.
        if (minor_ >= 3 || file_.onlyPaddingLeft()) return {};
        return fail(file_.malformedByte(
            file_.offset(), "data after the last of the announced " + countText(count_, "point")));
    }

    double coordinate(const char* record, std::size_t axis) const {
        return loadAs<std::int32_t>(record + 4 * axis, !machineIsLittleEndian()) * scale_[axis] +
               shift_[axis];
    }

    InputFile& file_;
    ScanContent content_;
    VertexSink sink_;
    unsigned major_ = 0;
    unsigned minor_ = 0;
    std::uint64_t recordSize_ = 0;
    std::uint64_t count_ = 0;
    std::array<double, 3> scale_ = {};
    std::array<double, 3> shift_ = {};
};

}  // namespace

Result<ScanContent> readLas(InputFile& file, std::size_t maxPoints) {
    return LasReader(file, maxPoints).read();
}

}  // namespace shapedb::io
