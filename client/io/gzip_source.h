// SPDX-License-Identifier: Apache-2.0
// What a gzip file holds. Private to client/io.
#pragma once

#include <memory>
#include <string>

#include "client/io/byte_source.h"

namespace shapedb::io {

/// Several members one after the other are one file, as gzip has it; zero bytes may follow. Read as it
/// unpacks: nothing is kept but a window of 32 KiB. Errors: kMalformedFile for damaged data and for a bomb:
/// more than 64 MiB that are more than 200 times their compressed size. `path` is for messages.
std::unique_ptr<ByteSource> makeGzipSource(std::string path, std::unique_ptr<ByteSource> packed);

}  // namespace shapedb::io
