// Writes manual pages and completions from the tables of options and keys, while we are built. What an option
// means is said once, in src/app/options.cpp and its like, and what a key means in src/core/config.
#include "manual.hpp"

#include "core/config/key_documents.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace webots_cloud::manual {
namespace {

/// As roff reads it: nothing in it is a command.
std::string roff(std::string_view text)
{
    std::string out;
    if (text.starts_with('.') || text.starts_with('\''))
        out += "\\&";
    for (char const c : text) {
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else
            out += c;
    }
    return out;
}

/// In quotes for a POSIX shell, and for zsh.
std::string quoted(std::string_view text)
{
    std::string out = "'";
    for (char const c : text)
        out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

/// In quotes for fish.
std::string fish_quoted(std::string_view text)
{
    std::string out = "'";
    for (char const c : text) {
        if (c == '\'' || c == '\\')
            out += '\\';
        out += c;
    }
    return out + "'";
}

/// For `_arguments` of zsh, to which brackets and colons mean something.
std::string zsh_text(std::string_view text)
{
    std::string out;
    for (char const c : text) {
        if (c == '[' || c == ']' || c == ':' || c == '\\')
            out += '\\';
        out += c;
    }
    return out;
}

std::string function_name(std::string_view program)
{
    std::string name = "_";
    for (char const c : program)
        name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    return name;
}

std::string joined(std::vector<std::string> const& words)
{
    std::string text;
    for (auto const& word : words)
        text += (text.empty() ? "" : " ") + word;
    return text;
}

std::string upper_case(std::string text)
{
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

void add_meanings(std::string& page, std::string const& heading, std::vector<Meaning> const& meanings)
{
    if (meanings.empty())
        return;
    page += ".SH " + heading + "\n";
    for (auto const& [name, meaning] : meanings)
        page += ".TP\n.B " + roff(name) + "\n" + roff(meaning) + ".\n";
}

/// Up to what the page is about.
std::string beginning_of(PageName const& page, std::string const& version, std::string const& summary)
{
    auto const* const title = page.section == 8   ? "System Administration"
                              : page.section == 5 ? "File Formats"
                                                  : "User Commands";
    return ".TH " + roff(upper_case(page.name)) + " " + std::to_string(page.section) +
           " \"\" \"webots_cloud " + version + "\" \"" + title + "\"\n.SH NAME\n" + roff(page.name) +
           " \\- " + roff(summary) + "\n.SH SYNOPSIS\n";
}

void add_description(std::string& page, std::vector<std::string> const& paragraphs)
{
    page += ".SH DESCRIPTION\n";
    for (auto const& paragraph : paragraphs)
        page += ".PP\n" + roff(paragraph) + "\n";
}

void add_see_also(std::string& page, std::vector<PageName> const& others)
{
    page += ".SH SEE ALSO\n";
    for (auto const& other : others)
        page += ".BR " + roff(other.name) + " (" + std::to_string(other.section) + ")" +
                (&other == &others.back() ? "\n" : ",\n");
}

void add_keys(std::string& page, std::span<core::ConfigKey const> keys)
{
    for (auto const& key : keys) {
        auto const facts = core::facts_of(key);
        page += ".TP\n.B " + roff(key.name) + "\n" + roff(facts.purpose) +
                "\n.br\nValue: " + roff(facts.value) + ".\n";
        if (!key.required)
            page += "Default: " + roff(facts.standard) + ".\n";
        if (key.required)
            page += "Required.\n";
        if (!key.alias.empty())
            page += "Older name: " + roff(key.alias) + ".\n";
        page += std::string(facts.effect) + "\n";
        if (key.keys.empty())
            continue;
        page += ".RS\n";
        add_keys(page, key.keys);
        page += ".RE\n";
    }
}

} // namespace

std::string man_page(ConfigurationManual const& manual)
{
    auto page = beginning_of({manual.name, 5}, manual.version, manual.summary);
    page += ".I " + roff(manual.file) + "\n";
    add_description(page, manual.description);
    for (auto const& topic : manual.topics) {
        page += ".SH " + roff(upper_case(std::string(topic.title))) + "\n";
        add_keys(page, topic.keys);
    }
    add_see_also(page, manual.see_also);
    return page;
}

std::string man_page(Manual const& manual)
{
    auto page = beginning_of({manual.name, manual.section}, manual.version, manual.summary);
    for (auto const& form : manual.forms)
        page += ".B " + roff(manual.name) + "\n" + roff(form) + "\n.br\n";
    add_description(page, manual.description);
    page += ".SH OPTIONS\n";
    for (auto const& option : manual.options) {
        page += ".TP\n.BR " + (option.letter ? std::string("\\-") + option.letter + " , \" \" " : "") +
                "\\-\\-" + roff(option.name);
        if (option.value.starts_with('=') || option.value.starts_with("[="))
            page += roff(option.value);
        else if (!option.value.empty())
            page += " \" " + roff(option.value) + "\"";
        page += "\n";
        page += roff(option.summary) + ".\n";
    }
    add_meanings(page, "SIGNALS", manual.signals);
    add_meanings(page, "EXIT STATUS", manual.exit_statuses);
    add_meanings(page, "FILES", manual.files);
    add_see_also(page, manual.see_also);
    return page;
}

std::string bash_completion(Manual const& manual)
{
    auto const function = function_name(manual.name);
    std::string words;
    std::string values; // cases of what follows an option
    std::string others; // options that anything may follow
    for (auto const& option : manual.options) {
        words += (words.empty() ? "--" : " --") + option.name;
        if (!option.choices.empty())
            values += "    --" + option.name + ")\n        COMPREPLY=($(compgen -W " +
                      quoted(joined(option.choices)) + " -- \"$word\"))\n        return\n        ;;\n";
        else if (!option.value.empty())
            others += (others.empty() ? "--" : " | --") + option.name;
    }
    if (!others.empty())
        values += "    " + others + ")\n        return\n        ;;\n";
    auto text = "# bash completion for " + manual.name + "\n\n" + function + "()\n{\n" +
                "    local word=${COMP_WORDS[COMP_CWORD]}\n";
    if (!values.empty())
        text += "    case ${COMP_WORDS[COMP_CWORD - 1]} in\n" + values + "    esac\n";
    text += "    if [[ $word == -* ]]; then\n        COMPREPLY=($(compgen -W " + quoted(words) +
            " -- \"$word\"))\n    else\n";
    text += manual.takes_configuration
                ? "        local IFS=$'\\n'\n"
                  "        COMPREPLY=($(compgen -d -- \"$word\") $(compgen -f -X '!*.json' -- \"$word\"))\n"
                : "        local IFS=$'\\n'\n        COMPREPLY=($(compgen -f -- \"$word\"))\n";
    return text + "        compopt -o filenames 2>/dev/null\n    fi\n}\n\ncomplete -F " + function + " " +
           manual.name + "\n";
}

std::string zsh_completion(Manual const& manual)
{
    auto text = "#compdef " + manual.name + "\n\n_arguments";
    for (auto const& option : manual.options) {
        auto what = "[" + zsh_text(option.summary) + "]";
        if (!option.value.empty())
            what += ":" + zsh_text(option.value) + ":" +
                    (option.choices.empty() ? "" : "(" + joined(option.choices) + ")");
        auto const name = "--" + option.name;
        text += " \\\n    ";
        if (option.letter) {
            auto const letter = std::string("-") + option.letter;
            text += quoted("(" + letter + " " + name + ")") + "{" + letter + "," + name + "}" + quoted(what);
        } else {
            text += quoted(name + what);
        }
    }
    return text + " \\\n    " +
           quoted(manual.takes_configuration ? "1:configuration:_files -g \"*.json\"" : "*:file:_files") +
           "\n";
}

std::string fish_completion(Manual const& manual)
{
    std::string text = "# fish completion for " + manual.name + "\n";
    for (auto const& option : manual.options) {
        text += "complete -c " + manual.name + " -l " + option.name;
        if (option.letter)
            text += std::string(" -s ") + option.letter;
        if (!option.choices.empty())
            text += " -x -a " + fish_quoted(joined(option.choices));
        else if (!option.value.empty())
            text += " -x";
        text += " -d " + fish_quoted(option.summary) + "\n";
    }
    return text;
}

} // namespace webots_cloud::manual
