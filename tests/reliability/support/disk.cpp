// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/disk.h"

#include <algorithm>
#include <filesystem>

#include "tests/reliability/support/files.h"

namespace shapedb::reliability {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSector = 512;

Disk* watching = nullptr;

bool endsWith(const std::string& text, const std::string& end) {
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

void apply(std::string& bytes, bool cut, std::uint64_t at, const char* data, std::size_t size) {
    if (cut || bytes.size() < at + size) bytes.resize(at + size, '\0');
    std::copy(data, data + size, bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace

Disk::Disk(std::string folder) : folder_(std::move(folder)) {
    for (const auto& entry : fs::directory_iterator(folder_)) {
        auto file = std::make_shared<File>();
        file->durable = readFile(entry.path().string());
        names_[entry.path().string()] = std::move(file);
    }
    durableNames_ = names_;
    markNamed_ = hasMark();
    watching = this;
}

Disk::~Disk() { watching = nullptr; }

Disk* Disk::current() { return watching; }

Disk* Disk::of(const std::string& path) {
    if (watching == nullptr) return nullptr;
    const bool inside = path == watching->folder_ || fs::path(path).parent_path() == watching->folder_;
    return inside && !endsWith(path, "-shm") ? watching : nullptr;
}

void Disk::notify() const {
    if (before) before();
}

void Disk::rename(Renaming change) {
    for (const auto& [path, file] : change) {
        if (file == nullptr) {
            names_.erase(path);
        } else {
            names_[path] = file;
        }
    }
    pendingNames_.push_back(std::move(change));
}

Disk::FilePtr Disk::file(const std::string& path) {
    const auto found = names_.find(path);
    if (found != names_.end()) return found->second;
    // Made without SQLite, or just created: nothing of it is certain.
    auto fresh = std::make_shared<File>();
    std::string now = readFile(path);
    if (!now.empty()) fresh->pending.push_back({false, 0, std::move(now)});
    rename({{path, fresh}});
    return fresh;
}

void Disk::opened(const std::string& path) { static_cast<void>(file(path)); }

void Disk::written(const std::string& path, std::uint64_t offset, const void* data, std::size_t size) {
    notify();
    file(path)->pending.push_back({false, offset, std::string(static_cast<const char*>(data), size)});
}

void Disk::truncated(const std::string& path, std::uint64_t size) {
    notify();
    file(path)->pending.push_back({true, size, {}});
}

void Disk::synced(const std::string& path) {
    notify();
    if (path == folder_) {
        durableNames_ = names_;
        pendingNames_.clear();
        markNamed_ = markNamed_ || hasMark();
        return;
    }
    const auto found = names_.find(path);
    if (found == names_.end()) return;
    File& file = *found->second;
    for (const Change& change : file.pending)
        apply(file.durable, change.cut, change.at, change.bytes.data(), change.bytes.size());
    file.pending.clear();
}

// As Linux does it: what could not be written is forgotten, and no later sync brings it to the disk.
void Disk::syncFailed(const std::string& path) {
    const auto found = names_.find(path);
    if (found != names_.end()) found->second->pending.clear();
}

void Disk::removed(const std::string& path) {
    if (names_.count(path) == 0) return;
    notify();
    rename({{path, nullptr}});
}

void Disk::renamed(const std::string& from, const std::string& to) {
    notify();
    rename({{to, file(from)}, {from, nullptr}});
}

std::string Disk::bytesAfter(const File& file, Loss loss, Random& random) {
    std::string bytes = file.durable;
    if (loss == Loss::kAllUnsynced) return bytes;
    std::vector<Change> parts;
    for (const Change& change : file.pending) {
        if (change.cut) {
            parts.push_back(change);
            continue;
        }
        for (std::uint64_t done = 0; done < change.bytes.size();) {
            const std::uint64_t at = change.at + done;
            const std::uint64_t size =
                std::min<std::uint64_t>(kSector - at % kSector, change.bytes.size() - done);
            parts.push_back({false, at, change.bytes.substr(done, size)});
            done += size;
        }
    }
    for (std::size_t i = parts.size(); i > 1; --i) std::swap(parts[i - 1], parts[random.below(i)]);
    // Almost none, half or almost all of them.
    const double share = 0.02 + 0.48 * static_cast<double>(random.below(3));
    for (const Change& part : parts)
        if (random.uniform(0.0, 1.0) < share)
            apply(bytes, part.cut, part.at, part.bytes.data(), part.bytes.size());
    return bytes;
}

bool Disk::hasMark() const {
    for (const auto& entry : fs::directory_iterator(folder_)) {
        if (endsWith(entry.path().filename().string(), ".commits")) return true;
    }
    return false;
}

// The file that remembers how many changes were acknowledged is written without SQLite, and its name synced
// at start: it is as it is now, or before that was never there.
void Disk::addMark(Image& image, Loss loss, Random& random) const {
    if (!markNamed_ && loss == Loss::kRandom && random.below(3) == 0) return;
    for (const auto& entry : fs::directory_iterator(folder_)) {
        const std::string name = entry.path().filename().string();
        if (endsWith(name, ".commits")) image[name] = readFile(entry.path().string());
    }
}

Image Disk::afterPowerLoss(Loss loss, Random& random) const {
    Names names = durableNames_;
    // File systems keep the order of changes of names: some first ones.
    const std::size_t kept = loss == Loss::kAllUnsynced ? 0 : random.below(pendingNames_.size() + 1);
    for (std::size_t i = 0; i < kept; ++i) {
        for (const auto& [path, file] : pendingNames_[i]) names[path] = file;
    }
    Image image;
    for (const auto& [path, file] : names) {
        if (file != nullptr) image[fs::path(path).filename().string()] = bytesAfter(*file, loss, random);
    }
    addMark(image, loss, random);
    return image;
}

}  // namespace shapedb::reliability
