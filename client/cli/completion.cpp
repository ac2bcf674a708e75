// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/completion.h"

#include <CLI/CLI.hpp>

#include "client/cli/usage.h"

namespace shapedb::cli {

namespace {

constexpr const char* kBash = R"sh(# Completion of shapedb for bash: eval "$(shapedb completion bash)"
_shapedb() {
    local line
    COMPREPLY=()
    while IFS= read -r line; do
        case $line in
            :files) compopt -o default ;;
            *) COMPREPLY+=("${line%%$'\t'*}") ;;
        esac
    done < <("${COMP_WORDS[0]}" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -F _shapedb shapedb
)sh";

constexpr const char* kZsh = R"sh(#compdef shapedb
# Completion of shapedb for zsh: eval "$(shapedb completion zsh)", after compinit
_shapedb() {
    local line word told files=
    local -a found
    for line in ${(f)"$("${words[1]}" __complete "${(@)words[2,CURRENT]}" 2>/dev/null)"}; do
        case $line in
            :files) files=1 ;;
            *)
                word=${line%%$'\t'*} told=${line#*$'\t'}
                found+=("${word//:/\\:}${told:+:$told}") ;;
        esac
    done
    (( ${#found} )) && _describe shapedb found
    [[ -n $files ]] && _files
}
if [[ ${funcstack[1]} == _shapedb ]]; then
    _shapedb "$@"
else
    compdef _shapedb shapedb
fi
)sh";

constexpr const char* kFish = R"sh(# Completion of shapedb for fish: shapedb completion fish | source
function __shapedb_complete
    set -l typed (commandline -opc)
    set -l current (commandline -ct)
    for line in ($typed[1] __complete $typed[2..-1] "$current" 2>/dev/null)
        if test "$line" = ":files"
            __fish_complete_path "$current"
        else
            echo $line
        end
    end
end
complete -c shapedb -f -a '(__shapedb_complete)'
)sh";

bool isFlag(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

/// The option of a command or of those above it.
const CLI::Option* findOption(const CLI::App& command, const std::string& flag) {
    for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
        if (const CLI::Option* option = app->get_option_no_throw(flag)) return option;
    }
    return nullptr;
}

bool takesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

const CLI::App* findCommand(const CLI::App& app, const std::string& name) {
    for (const CLI::App* sub : shownCommands(app)) {
        if (sub->get_name() == name) return sub;
    }
    return nullptr;
}

/// The words that an option takes, if only some: those of CLI::IsMember, which describes itself as
/// "TEXT:{a,b}".
std::vector<std::string> choicesOf(const CLI::Option& option) {
    std::string text = option.get_type_name();
    const std::size_t open = text.find('{');
    const std::size_t close = text.find('}', open);
    if (open == std::string::npos || close == std::string::npos) return {};
    std::vector<std::string> choices = CLI::detail::split(text.substr(open + 1, close - open - 1), ',');
    for (std::string& choice : choices) CLI::detail::trim(choice);
    return choices;
}

bool namesPath(const CLI::Option& option) {
    const std::string words = option.get_name(true, true) + " " + option.get_type_name();
    for (const char* word : {"FILE", "DIR", "PATH", "FOLDER", "QUERY", "OTHER", "GALLERY"}) {
        if (words.find(word) != std::string::npos) return true;
    }
    return false;
}

class Finder {
  public:
    explicit Finder(const std::string& typed) : typed_(typed) {}

    void offer(const std::string& text, std::string description) {
        if (text.compare(0, typed_.size(), typed_) != 0) return;
        // One line each; a tab ends the word.
        for (char& c : description) {
            if (c == '\n' || c == '\t') c = ' ';
        }
        found.words.push_back({text, std::move(description)});
    }
    void offerValues(const CLI::Option& option) {
        for (const std::string& choice : choicesOf(option)) offer(choice, {});
        found.files = found.files || namesPath(option);
    }
    void offerFlags(const CLI::App& command) {
        for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
            for (const CLI::Option* option : optionsOf(*app)) {
                // Each command has its own --help.
                if (app != &command && option == app->get_help_ptr()) continue;
                for (const std::string& name : option->get_lnames())
                    offer("--" + name, option->get_description());
            }
        }
    }

    Completion found;

  private:
    const std::string& typed_;
};

}  // namespace

Completion complete(const CLI::App& app, const std::vector<std::string>& words) {
    const std::string typed = words.empty() ? std::string() : words.back();
    const CLI::App* command = &app;
    const CLI::Option* wanting = nullptr;  // an option that the next word is the value of
    for (std::size_t i = 0; i + 1 < words.size(); ++i) {
        const std::string& word = words[i];
        if (wanting != nullptr) {
            wanting = nullptr;
        } else if (isFlag(word)) {
            const CLI::Option* option = findOption(*command, word);
            if (option != nullptr && takesValue(*option)) wanting = option;
        } else if (const CLI::App* sub = findCommand(*command, word)) {
            command = sub;
        }
    }
    Finder finder(typed);
    if (wanting != nullptr) {
        finder.offerValues(*wanting);
    } else if (!typed.empty() && typed.front() == '-') {
        finder.offerFlags(*command);
    } else {
        for (const CLI::App* sub : shownCommands(*command))
            finder.offer(sub->get_name(), sub->get_description());
        for (const CLI::Option* option : optionsOf(*command)) {
            if (option->get_positional()) finder.offerValues(*option);
        }
    }
    return finder.found;
}

std::string completionText(const CLI::App& app, const std::vector<std::string>& words) {
    const Completion found = complete(app, words);
    std::string text;
    for (const Completion::Word& word : found.words) text += word.text + "\t" + word.description + "\n";
    return text + (found.files ? ":files\n" : "");
}

std::optional<std::string> completionScript(const std::string& shell) {
    if (shell == "bash") return kBash;
    if (shell == "zsh") return kZsh;
    if (shell == "fish") return kFish;
    return std::nullopt;
}

}  // namespace shapedb::cli
