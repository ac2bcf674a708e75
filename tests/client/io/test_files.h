// SPDX-License-Identifier: GPL-3.0-or-later
// Files of every format, in a temporary folder.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "client/io/scan_reader.h"

namespace shapedb {

constexpr ErrorCode kMalformed = ErrorCode::kMalformedFile;

/// Gives each test a temporary folder.
class FileTest : public ::testing::Test {
  protected:
    FileTest();
    ~FileTest() override;

    /// Creates folders in `name` as needed. Returns the path.
    std::string write(const std::string& name, const std::string& bytes) const;
    std::string path(const std::string& name) const { return folder_ + "/" + name; }
    const std::string& folder() const { return folder_; }

    /// Writes and reads, with MeshHandling::kVertices.
    Result<Scan> readVertices(const std::string& name, const std::string& bytes) const;
    /// Writes and reads; fails the test (and returns an empty Scan) on an error.
    Scan readGood(const std::string& name, const std::string& bytes) const;
    /// Writes and reads; expects this error, with the file and all parts in the message.
    void expectError(const std::string& name, const std::string& bytes, ErrorCode code,
                     const std::vector<std::string>& parts) const;

  private:
    std::string folder_;
};

/// Numbers as bytes, in either byte order.
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

/// A small valid file.
struct SampleFile {
    std::string name;
    std::string bytes;
    std::size_t vertices;
    std::size_t triangles;
};

/// At least one file of every format and variant, each with the vertices of sampleVertices() in that order
/// (STL: the first four).
std::vector<SampleFile> sampleFiles();
PointCloud sampleVertices();

/// A ZIP archive of these entries.
std::string zipArchive(const std::vector<std::pair<std::string, std::string>>& entries);
/// A .glb file of a JSON and a binary chunk; no BIN chunk if that is empty.
std::string glb(const std::string& json, const std::string& binary);
std::string base64(const std::string& bytes);
std::string unBase64(const std::string& text);

/// Body of a binary_compressed PCD file: both sizes, then the LZF-compressed data, field by field.
std::string compressedPcdBody(const std::string& fieldByField);

}  // namespace shapedb
