// SPDX-License-Identifier: Apache-2.0
#include "client/io/text_file.h"

#include <new>

#include "client/io/output_file.h"
#include "core/base/return_if_error.h"

namespace shapedb {

Result<void> writeTextFile(const std::string& path, const std::string& text) {
    try {
        auto file = io::OutputFile::create(path);
        RETURN_IF_ERROR(file);
        RETURN_IF_ERROR(file->write(text));
        return file->commit();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, path + ": not enough memory to write the file");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kFileNotWritable, path + ": cannot be written: " + e.what());
    }
}

}  // namespace shapedb
