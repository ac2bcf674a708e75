// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/entries.h"

#include <utility>

#include "core/signature/signature_codec.h"
#include "core/views/views_codec.h"

namespace shapedb::index {

bool toEntry(store::IndexRow&& row, IndexEntry& entry, telemetry::Logger& log) {
    if (const auto decoded = decodeSignature(row.signature.bytes, entry.signature); !decoded) {
        auto fields = telemetry::fieldsOf(decoded.error());
        fields.push_back({"shape", row.shapeId});
        fields.push_back({"key", row.key});
        log.error("stored signature is damaged: left out of searches until a rebuild", fields);
        return false;
    }
    entry.id = row.shapeId;
    entry.key = std::move(row.key);
    entry.metadata = std::move(row.metadata);
    entry.views = nullptr;
    if (row.signature.views.empty()) return true;
    if (const auto views = decodeViews(row.signature.views)) {
        entry.views = std::make_shared<const ShapeViews>(*views);
    } else {
        auto fields = telemetry::fieldsOf(views.error());
        fields.push_back({"shape", row.shapeId});
        log.error("stored views are damaged: scans of one side may not find this shape until a rebuild",
                  fields);
    }
    return true;
}

std::shared_ptr<const SignatureBlock> toBlock(std::vector<store::IndexRow>&& rows, telemetry::Logger& log) {
    auto block = std::make_shared<SignatureBlock>();
    block->reserve(rows.size());
    IndexEntry entry;  // one for all rows: reuses its memory
    for (store::IndexRow& row : rows) {
        if (toEntry(std::move(row), entry, log)) block->append(entry);
    }
    block->shrink();
    return block;
}

}  // namespace shapedb::index
