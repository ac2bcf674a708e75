// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes restores: whatever file is offered, it is refused, or the database is sound and can be used
// afterwards. The input overwrites pieces of a good backup: place (4 bytes), length, bytes; and may cut it.
#include <fstream>
#include <iterator>
#include <memory>

#include "server/store/sqlite/sqlite_store.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

/// Never the end of a run: libFuzzer ends the process.
struct Target {
    Target() {
        store::SqliteOptions options;
        options.path = "/dev/shm/shapedb-fuzz-" + std::to_string(::getpid()) + ".sqlite";
        store = std::move(*store::openSqliteStore(options));
        const auto collection = store->createCollection("c", "", "");
        require(static_cast<bool>(collection), "the target works");
        for (int i = 0; i < 5; ++i) {
            const auto tag = static_cast<float>(i);
            store::PutRequest request(*store::VerifiedScan::verify({tag, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 2}));
            request.collectionId = collection->id;
            request.key = "key " + std::to_string(i);
            request.metadata = store::replacedBy({{"label", "x"}});
            request.maxQueuedJobs = 100;
            request.maxQueuedBytes = 1 << 20;
            require(static_cast<bool>(store->putShape(request)), "the target works");
        }
        const std::string path = options.path + ".backup";
        std::remove(path.c_str());
        require(static_cast<bool>(store->backup(path, {})), "the target works");
        std::ifstream stream(path, std::ios::binary);
        backup.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    }
    std::unique_ptr<store::Store> store;
    std::string backup;
};

std::string damaged(std::string file, fuzz::Input& input) {
    if (input.byte() % 8 == 0) file.resize(input.number<std::uint32_t>() % (file.size() + 1));
    while (input.left() > 0 && !file.empty()) {
        const std::size_t at = input.number<std::uint32_t>() % file.size();
        const std::string bytes = input.bytes(input.byte() % 64);
        file.replace(at, std::min(bytes.size(), file.size() - at), bytes.substr(0, file.size() - at));
    }
    return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Target target;
    fuzz::Input input(data, size);
    const std::string path = fuzz::writeFile(".restore", damaged(target.backup, input));
    const auto restored = target.store->restore(path, {}, {});
    if (!restored) require(!restored.error().message.empty(), "errors have a message");
    const auto problems = target.store->check({});
    require(static_cast<bool>(problems), "the database can be checked");
    if (!problems->empty()) std::fprintf(stderr, "%s\n", problems->front().c_str());
    require(problems->empty(), "the database is sound after a restore, and after one that was refused");
    const auto collections = target.store->listCollections();
    require(static_cast<bool>(collections), "the database can be read");
    for (const store::Collection& one : *collections) {
        const auto shapes = target.store->listShapes(one.id, 0, 100, {});
        require(static_cast<bool>(shapes), "the shapes can be read");
        for (const store::Shape& shape : *shapes) {
            require(static_cast<bool>(target.store->loadPoints(shape.id)), "the points can be read");
        }
    }
    return 0;
}
