// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the streams that clients send: scans in chunks, and backups in parts. The first byte chooses; after
// the header each message is a length and its bytes.
#include <cmath>

#include "server/catalog/backup_upload.h"
#include "server/catalog/gates.h"
#include "server/catalog/scan_upload.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

constexpr std::uint64_t kMaxPoints = 2'000;

void tryScan(fuzz::Input& input) {
    catalog::Budget budget(1 << 16, "bytes");
    {
        catalog::ScanUpload upload(kMaxPoints, budget);
        const std::uint64_t announced = input.number<std::uint16_t>();
        const bool begun = input.byte() % 8 != 0;
        if (begun && !upload.begin(announced, input.byte() % 4 == 0 ? input.bytes(32) : "")) return;
        while (input.left() > 0) {
            const std::size_t size = std::size_t{12} * input.byte() + (input.byte() % 16 == 0 ? 5 : 0);
            if (!upload.add(input.bytes(size))) return;
        }
        const auto scan = upload.finish();
        if (fuzz::valueOrExplained(scan) == nullptr) return;
        require(begun, "no scan without a header");
        require(scan->points().size() == 3 * announced, "as many points as announced");
        for (const float c : scan->points()) require(std::isfinite(c), "points are finite");
    }
    catalog::Budget::Share all(budget);
    require(static_cast<bool>(all.take(1 << 16)), "an upload gives back what it took");
}

void tryBackup(fuzz::Input& input) {
    catalog::BackupUpload upload;
    while (input.left() > 0) {
        const std::uint64_t total = input.byte() % 2 == 0 ? 0 : input.number<std::uint16_t>();
        const std::string data = input.bytes(input.byte());
        const std::string sum = input.byte() % 8 == 0 ? input.bytes(32) : "";
        if (!upload.add({total, data, sum})) return;
    }
    static_cast<void>(upload.finish());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    if (input.byte() % 2 == 0) {
        tryScan(input);
    } else {
        tryBackup(input);
    }
    return 0;
}
