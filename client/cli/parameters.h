// The flags that choose how a scan is segmented and scored, the same for every command.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/types.h"
#include "core/base/error.h"
#include "core/matching/score_options.h"
#include "core/pipeline.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

/// --profile and one flag per parameter; what is not given keeps the profile's value.
struct ParameterFlags {
    std::optional<std::string> profile;
    std::optional<std::string> interior;
    client::Parameters numbers;  ///< all but `profile` and `interiorMethod`, which have a name

    /// For segmenting here. Errors: kInvalidArgument naming the value and its range.
    [[nodiscard]] Result<ShapeParameters> resolve() const;
    /// For the server, which fills in what is not given.
    [[nodiscard]] client::Parameters forServer() const;
    [[nodiscard]] bool any() const;
};

/// `flags` must outlive the parsing.
void addParameterFlags(CLI::App& command, ParameterFlags& flags);

/// --no-reflection, --keep-scale and --partial.
struct ScoreFlags {
    bool noReflection = false;
    bool keepScale = false;
    bool partial = false;

    [[nodiscard]] ScoreOptions resolve() const;
};

void addScoreFlags(CLI::App& command, ScoreFlags& flags);

/// One member a parameter, by its name in the API.
[[nodiscard]] nlohmann::json toJson(const ShapeParameters& parameters);
/// The same of a server's collection.
[[nodiscard]] nlohmann::json toJson(const client::Parameters& parameters);

}  // namespace shapedb::cli
