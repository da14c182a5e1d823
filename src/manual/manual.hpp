// What is generated of the tables of programs and of their configurations: manual pages, and completions for
// shells.
#pragma once

#include "core/config/config_keys.hpp"

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::manual {

struct Option
{
    std::string name;  ///< Without dashes.
    char letter = 0;   ///< As in `-h`; 0: none.
    std::string value; ///< What follows it, after a blank unless it begins with `=` or `[=`.
    std::vector<std::string> choices;
    std::string summary;
};

/// A name, and what it means.
using Meaning = std::pair<std::string, std::string>;

/// Another page.
struct PageName
{
    std::string name;
    int section = 8;
};

/// All that is known of a program.
struct Manual
{
    std::string name;
    int section = 8; ///< Of the manual.
    std::string version;
    std::string summary;
    std::vector<std::string> forms;       ///< What may follow the name.
    std::vector<std::string> description; ///< Paragraphs.
    std::vector<Option> options;
    std::vector<Meaning> signals;
    std::vector<Meaning> exit_statuses;
    std::vector<Meaning> files;
    std::vector<PageName> see_also;
    bool takes_configuration = false; ///< Its argument is a JSON file.
};

/// The file that configures a program.
struct ConfigurationManual
{
    std::string name; ///< Of the page, whose section is 5.
    std::string version;
    std::string summary;
    std::string file;                     ///< Where packages put it.
    std::vector<std::string> description; ///< Paragraphs.
    std::span<core::ConfigTopic const> topics;
    std::vector<PageName> see_also;
};

/// In the macros of man(7).
std::string man_page(Manual const& manual);
std::string man_page(ConfigurationManual const& manual);
std::string bash_completion(Manual const& manual);
std::string zsh_completion(Manual const& manual);
std::string fish_completion(Manual const& manual);

} // namespace webots_cloud::manual
