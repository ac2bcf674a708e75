// SPDX-License-Identifier: GPL-3.0-or-later
// The flags that choose how a scan is segmented and scored, the same for every command.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "client/api/types.h"
#include "core/base/error.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/search/verify.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

/// --profile and one flag per parameter.
struct ParameterFlags {
    /// What the user gave; a server fills in the rest.
    client::Parameters given;

    [[nodiscard]] bool any() const;
    /// For segmenting here: the rest comes from the profile. Errors: kInvalidArgument naming the value and
    /// its range.
    [[nodiscard]] Result<ShapeParameters> resolve() const;
};

/// `flags` must outlive the parsing.
void addParameterFlags(CLI::App& command, ParameterFlags& flags);

/// --units, for commands that set the parameters of a collection.
void addUnitsFlag(CLI::App& command, ParameterFlags& flags);

/// --unit: of the files that a command reads.
void addUnitFlag(CLI::App& command, std::optional<LengthUnit>& unit);

/// --no-reflection, --keep-scale and --partial.
struct ScoreFlags {
    bool noReflection = false;
    bool keepScale = false;
    bool partial = false;
    bool freeScale = false;  ///< --free-scale, of commands that have it

    [[nodiscard]] ScoreOptions resolve() const;
    /// For a server.
    [[nodiscard]] client::CompareOptions forServer() const {
        return {!noReflection, keepScale, freeScale, partial};
    }
};

void addScoreFlags(CLI::App& command, ScoreFlags& flags);
/// --free-scale, beside those of addScoreFlags.
void addFreeScaleFlag(CLI::App& command, ScoreFlags& flags);

/// --verify, --no-verify, --candidates, --one-sided, --all-sides and --viewpoint.
struct VerifyFlags {
    /// Nothing: yes, but not with profile `paper`.
    std::optional<bool> verify;
    std::uint32_t candidates = 0;   ///< that are verified at most; 0: as many as the query needs
    std::optional<bool> oneSided;   ///< nothing: judged from the points
    std::vector<double> viewpoint;  ///< x, y, z; or empty

    [[nodiscard]] bool resolve(Profile profile) const {
        return verify.value_or(profile == Profile::kDefault);
    }
    [[nodiscard]] VerifyOptions options() const;
};

void addVerifyFlags(CLI::App& command, VerifyFlags& flags);

/// --at-least and --allow-partial: what several servers with one database may answer.
struct ClusterFlags {
    std::int64_t atLeast = 0;
    bool allowPartial = false;
};

void addClusterFlags(CLI::App& command, ClusterFlags& flags);

/// The line for SearchReply::covered below 1.
[[nodiscard]] std::string coveredText(double covered);

/// One member per parameter, by its name in the API.
[[nodiscard]] nlohmann::json toJson(const ShapeParameters& parameters);
[[nodiscard]] nlohmann::json toJson(const client::Parameters& parameters);

}  // namespace shapedb::cli
