// SPDX-License-Identifier: Apache-2.0
// Where the bytes of a scan file come from: the file itself, or what it holds in another encoding. Private to
// client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "core/base/error.h"

namespace shapedb::io {

/// Read once, front to back. Not thread-safe.
class ByteSource {
  public:
    ByteSource() = default;
    ByteSource(const ByteSource&) = delete;
    ByteSource& operator=(const ByteSource&) = delete;
    virtual ~ByteSource() = default;

    /// At least one and at most `size` bytes, written to `to`; 0 only at the end. `size` is at least 1.
    /// Errors: kFileNotReadable, kMalformedFile; they name the file.
    virtual Result<std::size_t> read(char* to, std::size_t size) = 0;
    /// Bytes of the file itself that have been read so far.
    virtual std::uint64_t position() const = 0;
};

/// The bytes of an open file, which it closes. `path` is for messages.
std::unique_ptr<ByteSource> makeFileSource(std::string path, int descriptor);

/// `bytes`, which have been read from `rest` already, and then the rest.
std::unique_ptr<ByteSource> putBack(std::string bytes, std::unique_ptr<ByteSource> rest);

/// UTF-16 text as UTF-8. Halves of surrogate pairs become the replacement character; half a character at the
/// end is kMalformedFile.
std::unique_ptr<ByteSource> makeUtf16Source(std::string path, std::unique_ptr<ByteSource> text,
                                            bool bigEndian);

/// What a gzip file holds. Several members one after the other are one file, as gzip has it; zero bytes may
/// follow. Read as it unpacks: nothing is kept but a window of 32 KiB. Errors: kMalformedFile for damaged
/// data and for a bomb: more than 64 MiB that are more than 200 times their compressed size. `path` is for
/// messages.
std::unique_ptr<ByteSource> makeGzipSource(std::string path, std::unique_ptr<ByteSource> packed);

// How much packed data may unpack to.

/// Scans as text shrink to a third, those of few different numbers to a twentieth.
constexpr std::uint64_t kGreatestPackingRatio = 200;
constexpr std::uint64_t kAlwaysUnpackedBytes = std::uint64_t{64} << 20;

inline bool isBomb(std::uint64_t unpacked, std::uint64_t packed) {
    return unpacked > kAlwaysUnpackedBytes && unpacked / kGreatestPackingRatio > packed;
}

inline std::string bombText() {
    return "more than " + std::to_string(kGreatestPackingRatio) +
           " times as large when unpacked, which is not read from packed files; if it is meant to be, unpack "
           "it first, e.g. with gunzip";
}

}  // namespace shapedb::io
