// What the command lines of the servers understand: for parsing, for `--help`, for manual pages and
// completions.
#pragma once

#include "daemon.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::app {

struct ProgramOption
{
    std::string name;                 ///< Without dashes.
    char letter = 0;                  ///< As in `-h`; 0: none.
    std::string value;                ///< What follows it, as in `ADDRESS`; empty: nothing does.
    std::vector<std::string> choices; ///< The words that `value` may be; empty: any.
    std::string summary;              ///< A sentence without capital letter and full stop.
};

/// In alphabetical order.
std::vector<ProgramOption> options_of(Program const& program);

/// A name, and what it means.
using Meaning = std::pair<std::string, std::string>;

/// What a running server does when it gets a signal.
std::vector<Meaning> signals_of(Program const& program);

std::vector<Meaning> exit_statuses();

} // namespace webots_cloud::app
