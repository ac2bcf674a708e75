// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the texts of a request: filters, cursors, keys, names, metadata, API keys, and what is shown of
// them. The first byte chooses which.
#include "common/safe_text.h"
#include "core/search/filter.h"
#include "server/catalog/listing.h"
#include "server/catalog/request_checks.h"
#include "server/config/settings.h"
#include "server/security/key.h"
#include "server/store/key_rules.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

void tryFilter(const std::string& text) {
    const auto filter = Filter::parse(text);
    if (fuzz::valueOrExplained(filter) == nullptr) return;
    const std::map<std::string, std::string> some = {{"label", "cup"}, {"mass", "1.5"}, {"a", ""}};
    static_cast<void>(filter->matches({}));
    static_cast<void>(filter->matches(some));
    static_cast<void>(filter->matches(some, "cup/cup_01"));
    if (!filter->asksForKeys()) {
        require(filter->matches(some, "a") == filter->matches(some, "b"), "no key asked for, none looked at");
    }
    if (filter->acceptsAll()) require(filter->matches({}) && filter->matches(some), "no term, no condition");
}

void tryCursor(const std::string& text) {
    for (const store::ShapeOrder order :
         {store::ShapeOrder::kId, store::ShapeOrder::kKey, store::ShapeOrder::kUpdated}) {
        catalog::Listing listing{3, "label=cup", 1};
        listing.order = order;
        const auto decoded = catalog::decodeCursor(listing, text);
        if (fuzz::valueOrExplained(decoded) == nullptr || !*decoded) continue;
        require(catalog::encodeCursor(listing, **decoded) == text, "one place has one cursor");
    }
}

void tryNames(const std::string& text) {
    if (!store::problemOfKey(text)) {
        require(findUnsafe(text) == std::string::npos, "no key can act on a terminal");
        require(text.size() <= store::kMaxKeyBytes && !text.empty(), "keys have a length");
    }
    if (!store::problemOfCollectionName(text)) {
        require(text.find_first_of("/\n \\\"'") == std::string::npos, "names of collections are plain");
    }
    static_cast<void>(fuzz::valueOrExplained(config::parseEndpoint(text)));
    static_cast<void>(catalog::checkMetadata({{text, text}}));
}

void tryApiKey(const std::string& text) {
    const auto key = security::parseApiKey(text);
    if (key) require(key->text() == text, "one key has one text");
}

void tryEscape(const std::string& text) {
    for (const bool newlines : {false, true}) {
        const std::string safe = escapeUnsafe(text, newlines);
        require(isUtf8(safe), "what is shown is UTF-8");
        if (!newlines) require(findUnsafe(safe) == std::string::npos, "what is shown is safe");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const int kind = input.byte() % 5;
    const std::string text = input.rest();
    if (kind == 0) tryFilter(text);
    if (kind == 1) tryCursor(text);
    if (kind == 2) tryNames(text);
    if (kind == 3) tryApiKey(text);
    if (kind == 4) tryEscape(text);
    return 0;
}
