// SPDX-License-Identifier: GPL-3.0-or-later
// Answers of searches as text, as JSON and as rows of a table.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/cli/search_run.h"

namespace shapedb::cli {

/// Which hits the text explains.
enum class Explained { kNone, kFirst, kAll };

[[nodiscard]] nlohmann::json answerJson(const SearchFlags& flags, const Answer& answer);
[[nodiscard]] std::string answerText(const SearchFlags& flags, const Answer& answer, Explained explained);

/// The first line of a CSV file of hits.
[[nodiscard]] std::string hitsCsvHeader();
/// A line for each hit.
[[nodiscard]] std::string hitsCsv(const Answer& answer);

}  // namespace shapedb::cli
