// Files of every format, made in a temporary folder.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/io/scan_reader.h"

namespace shapedb {

/// A folder of its own for each test, removed at the end.
class FileTest : public ::testing::Test {
  protected:
    FileTest();
    ~FileTest() override;

    /// Writes the bytes and returns the path; folders in `name` are created.
    std::string write(const std::string& name, const std::string& bytes) const;
    std::string path(const std::string& name) const { return folder_ + "/" + name; }
    const std::string& folder() const { return folder_; }

    /// Writes and reads; the vertices as they are.
    Result<Scan> readVertices(const std::string& name, const std::string& bytes) const;
    /// Writes and reads, expects success (an empty Scan after a failure).
    Scan readGood(const std::string& name, const std::string& bytes) const;
    /// Writes and reads, expects this error, and that the message names the file and has every part.
    void expectError(const std::string& name, const std::string& bytes, ErrorCode code,
                     const std::vector<std::string>& parts) const;

  private:
    std::string folder_;
};

/// Bytes of numbers in either order.
class Bytes {
  public:
    explicit Bytes(bool bigEndian = false) : bigEndian_(bigEndian) {}

    template <typename T>
    Bytes& add(T value) {
        const char* raw = reinterpret_cast<const char*>(&value);
        for (std::size_t i = 0; i < sizeof value; ++i) bytes_ += raw[bigEndian_ ? sizeof value - 1 - i : i];
        return *this;
    }
    Bytes& text(const std::string& text) {
        bytes_ += text;
        return *this;
    }
    const std::string& str() const { return bytes_; }

  private:
    bool bigEndian_;
    std::string bytes_;
};

/// A small file that is read without an error.
struct SampleFile {
    std::string name;
    std::string bytes;
    std::size_t vertices;
    std::size_t triangles;
};

/// At least one file of every format and variant; each has the vertices of sampleVertices() in
/// this order (STL: the first four).
std::vector<SampleFile> sampleFiles();
PointCloud sampleVertices();

/// Field-by-field, LZF-compressed body of a PCD file with both sizes in front.
std::string compressedPcdBody(const std::string& fieldByField);

}  // namespace shapedb
