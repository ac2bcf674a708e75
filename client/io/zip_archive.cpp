// SPDX-License-Identifier: Apache-2.0
#include "client/io/zip_archive.h"

#include <new>
#include <utility>
#include <vector>

#include <zip.h>

#include "client/io/byte_source.h"
#include "client/io/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

void ZipArchive::Close::operator()(zip* archive) const { ::zip_discard(archive); }

Result<ZipArchive> ZipArchive::read(InputFile& file) {
    ZipArchive archive(file);
    archive.bytes_ = std::make_unique<std::string>();
    while (!file.peek(1).empty()) {
        RETURN_IF_ERROR(file.context().checkpoint());
        archive.bytes_->append(file.data(), file.available());
        file.consume(file.available());
    }
    zip_error_t error;
    ::zip_error_init(&error);
    zip_source_t* source =
        ::zip_source_buffer_create(archive.bytes_->data(), archive.bytes_->size(), /*freep=*/0, &error);
    if (source == nullptr) throw std::bad_alloc();
    archive.archive_.reset(::zip_open_from_source(source, ZIP_RDONLY, &error));
    if (archive.archive_ == nullptr) {
        ::zip_source_free(source);
        const std::string reason = inQuotes(::zip_error_strerror(&error));
        ::zip_error_fini(&error);
        return fail(file.malformed("this is not a ZIP archive, or it is damaged: " + reason));
    }
    ::zip_error_fini(&error);
    return archive;
}

bool ZipArchive::has(const std::string& entry) const {
    return ::zip_name_locate(archive_.get(), entry.c_str(), ZIP_FL_NOCASE) >= 0;
}

Result<void> ZipArchive::visit(const std::string& entry,
                               const std::function<Result<void>(std::string_view)>& visit) {
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> stream(
        ::zip_fopen(archive_.get(), entry.c_str(), ZIP_FL_NOCASE), ::zip_fclose);
    if (stream == nullptr) {
        return fail(file_->malformed("the archive's entry " + inQuotes(entry) +
                                     " cannot be read: " + inQuotes(::zip_strerror(archive_.get()))));
    }
    std::vector<char> part(std::size_t{1} << 16);
    for (;;) {
        RETURN_IF_ERROR(file_->context().checkpoint());
        const zip_int64_t got = ::zip_fread(stream.get(), part.data(), part.size());
        if (got < 0) return fail(file_->malformed("the archive's entry " + inQuotes(entry) + " is damaged"));
        if (got == 0) return {};
        unpacked_ += static_cast<std::uint64_t>(got);
        if (isBomb(unpacked_, bytes_->size())) return fail(file_->malformed(bombText()));
        RETURN_IF_ERROR(visit(std::string_view(part.data(), static_cast<std::size_t>(got))));
    }
}

}  // namespace shapedb::io
