// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/upload.h"

#include <map>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// Standard input has no name that a key could come from.
Result<Upload> uploadOfStandardInput(const AddFlags& flags) {
    if (flags.key.empty()) return fail(ErrorCode::kInvalidArgument, "standard input needs --key");
    if (flags.each) {
        return fail(ErrorCode::kInvalidArgument,
                    "--each reads a scan twice, which standard input cannot be: give a file");
    }
    Upload upload;
    upload.path = upload.name = "-";
    return upload;
}

Result<void> listPath(const AddFlags& flags, const std::string& path, std::vector<Upload>& uploads) {
    const auto files = listScanFiles({path}, !flags.scan.format.empty());
    RETURN_IF_ERROR(files);
    for (const ScanFile& file : *files) {
        Upload upload;
        upload.path = file.path;
        upload.name = relativeName(file.path, path);
        auto key = keyOfFile(file.path, flags.base, flags.keepEnding || file.sharesName);
        RETURN_IF_ERROR(key);
        upload.key = std::move(*key);
        upload.label = file.label;
        uploads.push_back(std::move(upload));
    }
    return {};
}

/// Errors: kInvalidArgument naming two files with one key.
Result<void> checkKeys(const std::vector<Upload>& uploads) {
    std::map<std::string, std::string> taken;
    for (const Upload& upload : uploads) {
        const auto [other, isNew] = taken.emplace(upload.key, upload.path);
        if (!isNew) {
            return fail(ErrorCode::kInvalidArgument,
                        other->second == upload.path ? upload.path + " is given twice"
                                                     : other->second + " and " + upload.path +
                                                           " would both get the key '" + upload.key +
                                                           "': --keep-ending tells files apart that differ "
                                                           "in their endings, --key names one");
        }
    }
    return {};
}

/// Whether `key` is one that --each may give an object of the scan with the key `of`: of/1, of/2, ...
bool mayBeObjectOf(const std::string& key, const std::string& of) {
    const std::size_t slash = key.rfind('/');
    return slash == of.size() && key.compare(0, slash, of) == 0 && slash + 1 < key.size() &&
           key.find_first_not_of("0123456789", slash + 1) == std::string::npos;
}

/// How many objects a scan has is known once it is read. Errors: kInvalidArgument naming two files of which
/// an object of one may get the key of the other.
Result<void> checkKeysOfObjects(const std::vector<Upload>& uploads) {
    std::map<std::string, std::string> taken;
    for (const Upload& upload : uploads) taken.emplace(upload.key, upload.path);
    for (const Upload& upload : uploads) {
        const auto parent = taken.find(upload.key.substr(0, upload.key.rfind('/')));
        if (parent == taken.end() || !mayBeObjectOf(upload.key, parent->first)) continue;
        return fail(ErrorCode::kInvalidArgument, "an object of " + parent->second + " and " + upload.path +
                                                     " might both get the key '" + upload.key +
                                                     "'; add them one by one with --key");
    }
    return {};
}

}  // namespace

Result<std::vector<Upload>> listUploads(const AddFlags& flags) {
    std::vector<Upload> uploads;
    for (const std::string& path : flags.paths) {
        if (path == "-") {
            auto upload = uploadOfStandardInput(flags);
            RETURN_IF_ERROR(upload);
            uploads.push_back(std::move(*upload));
        } else {
            RETURN_IF_ERROR(listPath(flags, path, uploads));
        }
    }
    if (!flags.key.empty()) {
        if (uploads.size() != 1) {
            return fail(ErrorCode::kInvalidArgument,
                        "--key is for one scan, but there are " + std::to_string(uploads.size()) + " files");
        }
        uploads.front().key = flags.key;
    }
    RETURN_IF_ERROR(checkKeys(uploads));
    if (flags.each) RETURN_IF_ERROR(checkKeysOfObjects(uploads));
    return uploads;
}

client::AddRequest requestFor(const AddFlags& flags, const client::Metadata& metadata, const Upload& upload) {
    client::AddRequest request;
    request.shape = {flags.collection, upload.key};
    // Without any a shape that has the key keeps what it has.
    if (!metadata.empty() || flags.labelFromFolder) request.metadata = metadata;
    if (flags.labelFromFolder) request.metadata->emplace("label", upload.label);
    // Two files may come to the same key, at different times or from different people.
    if (!flags.replace) request.mode = client::AddMode::kSamePoints;
    if (flags.insertOnly) request.mode = client::AddMode::kInsertOnly;
    if (flags.updateOnly && flags.replace) request.mode = client::AddMode::kUpdateOnly;
    return request;
}

}  // namespace shapedb::cli
