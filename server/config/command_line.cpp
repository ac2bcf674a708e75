// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/config/command_line.h"

#include <algorithm>
#include <vector>

#include <CLI/CLI.hpp>

#include "common/nearest_name.h"
#include "server/config/load.h"
#include "server/config/settings.h"

namespace shapedb::config {

namespace {

std::vector<std::string> commandsOf(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

}  // namespace

std::string commandLineMessage(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App* chosen = &app;
    while (!chosen->get_subcommands().empty()) chosen = chosen->get_subcommands().front();
    const std::vector<std::string> unknown = app.remaining(true);
    if (!unknown.empty()) {
        const std::string& word = unknown.front();
        if (word.rfind("--", 0) == 0) return unknownOption(word, longFlags(chosen->get_options()));
        const auto commands = commandsOf(*chosen);
        if (!commands.empty())
            return "unknown command '" + word + "'" + didYouMean(nearestName(word, commands));
    }
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return message;
}

namespace {

constexpr char kBeforeSettings[] = R"(.SH NAME
shapedbd \- server of ShapeDB, a database of 3D shapes
.SH SYNOPSIS
.B shapedbd
.RB [ \-\-config
.IR FILE ]
.RB [ \-\-\fISETTING\fP
.IR VALUE ]...
.br
.B shapedbd key
.RB { create | list | revoke }
.I OPTION\fR...
.SH DESCRIPTION
Stores scans of 3D objects and finds those that look like another scan.
.BR shapedb (1)
is its client.
It serves until SIGTERM or SIGINT, shuts down cleanly then, and stops at once when it gets a second one.
Beyond this machine it does not start without TLS and API keys.
.PP
Once it serves, it prints
.B listening on
.I HOST:PORT
and, if it speaks HTTP too, a second line of that kind.
Everything else is logged.
.PP
.B shapedbd key
makes, lists and revokes API keys;
.B shapedbd key \-\-help
describes it.
.SH OPTIONS
.TP
.BI \-\-config " FILE"
Configuration file (TOML). Environment: SHAPEDB_CONFIG.
.TP
.B \-\-check\-config
Print every setting in force and where its value came from, and exit.
.TP
.B \-\-version
Print version, commit and build, and exit.
.TP
.B \-\-help
Print the flags, and exit.
.SH SETTINGS
Each is a flag, a variable of the environment, and a key of the configuration file.
Flags override the environment, which overrides the file.
)";

constexpr char kAfterSettings[] = R"(.SH EXIT STATUS
.TP
.B 0
It has shut down cleanly.
.TP
.B 1
It could not start, or not shut down cleanly.
.TP
.B 2
The configuration is wrong.
.TP
.B 130
A second signal has stopped it at once.
.SH FILES
.TP
.I /etc/shapedb/shapedbd.toml
Configuration of the system's service.
.TP
.I /var/lib/shapedb
Its data. Never copy the database while the server runs:
.B shapedb admin backup
does that.
.SH SEE ALSO
.BR shapedb (1),
.BR systemctl (1)
)";

/// Text of ours in a line of roff.
std::string roff(const std::string& text) {
    std::string line;
    for (const char c : text) {
        if (c == '\\') {
            line += "\\e";
        } else {
            if (c == '-' || (line.empty() && (c == '.' || c == '\''))) line += c == '-' ? "\\" : "\\&";
            line += c;
        }
    }
    return line;
}

}  // namespace

std::string manPage() {
    std::string page =
        std::string(".TH SHAPEDBD 8 \"\" \"ShapeDB ") + version() + "\" \"ShapeDB\"\n" + kBeforeSettings;
    const ServerConfig defaults;
    for (const Setting& setting : settings()) {
        const std::string shown = setting.show(defaults);
        page += ".TP\n.BI " + roff(setting.flag) + " \" VALUE\"\n" + roff(setting.help) + "\n.br\n" +
                roff(setting.range + "; default: " + (shown.empty() ? "empty" : shown)) + "\n.br\n" +
                roff("File: " + setting.key + ". Environment: " + setting.environment + ".") + "\n";
    }
    return page + kAfterSettings;
}

}  // namespace shapedb::config
