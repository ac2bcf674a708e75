// SPDX-License-Identifier: GPL-3.0-or-later
// What may be typed next, and the scripts by which shells ask for it.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace shapedb::cli {

struct Completion {
    struct Word {
        std::string text;
        std::string description;
    };
    std::vector<Word> words;
    bool files = false;  ///< paths may come here too
};

/// `words`: those after the program's name; the last is the one being typed, and may be empty.
[[nodiscard]] Completion complete(const CLI::App& app, const std::vector<std::string>& words);

/// The same as scripts read it: a line for each word, with its description after a tab; ":files" if paths may
/// come.
[[nodiscard]] std::string completionText(const CLI::App& app, const std::vector<std::string>& words);

/// For "bash", "zsh" or "fish": what its users load. Nothing for another shell. The script asks
/// `shapedb __complete WORD...` for every word, so it needs no update when commands change.
[[nodiscard]] std::optional<std::string> completionScript(const std::string& shell);

}  // namespace shapedb::cli
