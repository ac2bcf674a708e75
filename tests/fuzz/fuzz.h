// SPDX-License-Identifier: GPL-3.0-or-later
// What the fuzz targets share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <unistd.h>

#include "core/base/error.h"

namespace shapedb::fuzz {

inline void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "violated: %s\n", what);
    std::abort();
}

/// Whatever fails says why.
template <typename T>
const T* valueOrExplained(const Result<T>& result) {
    if (result) return &*result;
    require(!result.error().message.empty(), "errors have a message");
    return nullptr;
}

/// Takes the input apart from its start.
class Input {
  public:
    Input(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

    [[nodiscard]] std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
    std::uint8_t byte() { return left() == 0 ? 0 : *at_++; }
    /// At most `size` bytes.
    std::string bytes(std::size_t size) {
        size = size < left() ? size : left();
        std::string text(reinterpret_cast<const char*>(at_), size);
        at_ += size;
        return text;
    }
    std::string rest() { return bytes(left()); }
    template <typename Number>
    Number number() {
        Number value{};
        const std::string raw = bytes(sizeof value);
        std::memcpy(&value, raw.data(), raw.size());
        return value;
    }

  private:
    const std::uint8_t* at_;
    const std::uint8_t* end_;
};

/// A file in memory (/dev/shm is a tmpfs) with this content and an ending of its own.
inline std::string writeFile(const std::string& ending, const std::string& content) {
    const std::string path = "/dev/shm/shapedb-fuzz-" + std::to_string(::getpid()) + ending;
    std::FILE* file = std::fopen(path.c_str(), "wb");
    require(file != nullptr, "the fuzzer can write its file");
    require(std::fwrite(content.data(), 1, content.size(), file) == content.size(),
            "the fuzzer can write its file");
    std::fclose(file);
    return path;
}

}  // namespace shapedb::fuzz
