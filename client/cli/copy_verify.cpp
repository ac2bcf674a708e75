// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/copy_verify.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <thread>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// How often, and after which pause, differences are looked at again.
constexpr int kSecondLooks = 2;
constexpr std::chrono::milliseconds kLookPause{1000};

class Comparer {
  public:
    Comparer(const CopySides& sides,
             const std::function<void(const std::string&, std::uint64_t, std::uint64_t)>& progress,
             const RunContext& context)
        : sides_(sides), progress_(progress), context_(context) {}

    Result<CopyComparison> run() {
        RETURN_IF_ERROR(compareCollections());
        for (CollectionComparison& one : found_.collections) RETURN_IF_ERROR(compareShapes(one));
        const auto looksAgain = [&] { return found_.different > 0 && found_.different <= kMostNamed; };
        for (int look = 0; look < kSecondLooks && looksAgain(); ++look) {
            RETURN_IF_ERROR(context_.checkpoint());
            std::this_thread::sleep_for(kLookPause);
            RETURN_IF_ERROR(lookAgain());
        }
        return std::move(found_);
    }

  private:
    Result<void> compareCollections() {
        const auto from = sides_.from.listCollections(context_);
        RETURN_IF_ERROR(from);
        const auto to = sides_.to.listCollections(context_);
        RETURN_IF_ERROR(to);
        found_.steps = stepsBetween(*from, *to);
        for (const client::Collection& one : *from) {
            const auto other = std::find_if(to->begin(), to->end(),
                                            [&](const auto& there) { return there.name == one.name; });
            if (other != to->end()) found_.collections.push_back({one.name});
        }
        return {};
    }

    Result<void> compareShapes(CollectionComparison& one) {
        const std::string what = "compare " + one.name;
        return visitPairs(
            sides_, one.name,
            [&](ShapePair&& pair) -> Result<void> {
                one.from += pair.from ? 1 : 0;
                one.to += pair.to ? 1 : 0;
                progress_(what, std::max(one.from, one.to), 0);
                if (differenceOf(pair) == ShapeDifference::kNone) return {};
                ++one.different;
                ++found_.different;
                if (found_.differences.size() < kMostNamed) {
                    found_.differences.push_back({one.name, std::move(pair)});
                }
                return {};
            },
            context_);
    }

    /// Both sides of the keys that differed, at about the same time.
    Result<void> lookAgain() {
        std::map<std::string, std::vector<std::string>> keys;
        for (const NamedDifference& one : found_.differences) keys[one.collection].push_back(one.pair.key());
        found_.differences.clear();
        found_.different = 0;
        for (CollectionComparison& one : found_.collections) {
            one.different = 0;
            if (keys.count(one.name) == 0) continue;
            std::map<std::string, ShapePair> pairs;
            const auto from = sides_.from.getShapes(one.name, keys[one.name], context_);
            RETURN_IF_ERROR(from);
            const auto to = sides_.to.getShapes(one.name, keys[one.name], context_);
            RETURN_IF_ERROR(to);
            for (const client::Shape& shape : from->shapes) pairs[shape.key].from = shape;
            for (const client::Shape& shape : to->shapes) pairs[shape.key].to = shape;
            for (auto& [key, pair] : pairs) {
                if (differenceOf(pair) == ShapeDifference::kNone) continue;
                ++one.different;
                ++found_.different;
                found_.differences.push_back({one.name, std::move(pair)});
            }
        }
        return {};
    }

    const CopySides& sides_;
    const std::function<void(const std::string&, std::uint64_t, std::uint64_t)>& progress_;
    const RunContext& context_;
    CopyComparison found_;
};

}  // namespace

Result<CopyComparison> compareServers(
    const CopySides& sides,
    const std::function<void(const std::string& what, std::uint64_t done, std::uint64_t total)>& progress,
    const RunContext& context) {
    return Comparer(sides, progress, context).run();
}

}  // namespace shapedb::cli
