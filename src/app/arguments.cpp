// Reads command lines. Options and their texts are rows in options.cpp, from which the manual pages and
// completions are made, too; here they are obeyed.
#include "core/config/key_documents.hpp"
#include "core/doctor/finding.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"
#include "daemon.hpp"
#include "doctor/service_view.hpp"
#include "options.hpp"

#include <webots_cloud/adapters/logs.hpp>
#include <webots_cloud/version.hpp>

#include <boost/program_options/options_description.hpp>
#include <boost/program_options/parsers.hpp>
#include <boost/program_options/positional_options.hpp>
#include <boost/program_options/variables_map.hpp>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iostream>

#include <unistd.h>

namespace webots_cloud::app {

namespace fs = std::filesystem;
namespace options = boost::program_options;

namespace {

using core::concat;

/// Where what is installed in `prefix` has its configuration: what is in /usr and /usr/local has it in /etc.
fs::path etc_of(fs::path prefix)
{
    if (prefix.filename() == "local" && prefix.parent_path().filename() == "usr")
        prefix = prefix.parent_path();
    return (prefix.filename() == "usr" ? prefix.parent_path() : prefix) / "etc";
}

/// The default in the working directory, or else in the tree that the program was built or installed in.
/// Releases before 1.0 had theirs in /etc/webots_cloud.
fs::path find_default(Program const& program)
{
    auto const& relative = program.default_config;
    std::error_code ignored;
    if (fs::exists(relative, ignored))
        return relative;
    for (auto folder = program_folder(); folder.has_relative_path(); folder = folder.parent_path()) {
        auto const etc = etc_of(folder);
        for (auto const& candidate : {folder / relative, etc / "webots-cloud" / concat(program.kind, ".json"),
                                      etc / "webots_cloud" / program.kind / "config.json",
                                      folder / "share" / "webots_cloud" / relative})
            if (fs::exists(candidate, ignored))
                return candidate;
    }
    return relative;
}

/// In two columns.
std::string table(std::vector<Meaning> const& meanings)
{
    constexpr std::size_t gap = 2;
    std::size_t width = 0;
    for (auto const& [name, meaning] : meanings)
        width = std::max(width, name.size() + gap);
    std::string text;
    for (auto const& [name, meaning] : meanings)
        text += core::concat("  ", name, std::string(width - name.size(), ' '), meaning, "\n");
    return text;
}

std::span<core::ConfigTopic const> topics_of(Program const& program)
{
    return program.kind == "session" ? core::session_topics() : core::simulation_topics();
}

/// `--help KEY`; whoever names a file along with `--help` wants the general text.
bool is_key_asked(options::variables_map const& given)
{
    auto const& arguments = given["config"];
    return !arguments.empty() &&
           arguments.as<std::vector<std::string>>().front().find_first_of("./") == std::string::npos;
}

int print_key(Program const& program, std::string_view name)
{
    bool is_known = false;
    auto const page = core::key_page(name, topics_of(program), is_known);
    if (is_known)
        std::cout << page;
    else
        std::cerr << program.name << ": " << page;
    return is_known ? exit_ok : exit_usage;
}

options::options_description described(Program const& program)
{
    options::options_description shown("Options");
    for (auto const& option : options_of(program)) {
        auto const name = option.letter ? option.name + "," + option.letter : option.name;
        if (option.value.empty())
            shown.add_options()(name.c_str(), option.summary.c_str());
        else
            shown.add_options()(name.c_str(), options::value<std::string>()->value_name(option.value),
                                option.summary.c_str());
    }
    return shown;
}

/// What is printed in the place of a server's work.
/// Returns: the exit status; nothing: no text was asked for.
std::optional<int> print_asked(Program const& program, options::variables_map const& given,
                               options::options_description const& shown)
{
    if (given.count("help") && is_key_asked(given))
        return print_key(program, given["config"].as<std::vector<std::string>>().front());
    if (given.count("schema"))
        std::cout << core::json_schema(program.kind, topics_of(program));
    else if (given.count("help"))
        std::cout << "Usage: " << program.name << " [OPTION...] [CONFIG.json]\n\n"
                  << program.summary << "\n\nWithout CONFIG.json it reads " << program.default_config.string()
                  << ", or else\n/etc/webots-cloud/" << program.kind
                  << ".json. It stays in the foreground. Its log is in\nlog/" << program.kind
                  << " unless \"logDir\" or \"debug\" say otherwise.\n\n"
                  << shown << "\nSignals:\n"
                  << table(signals_of(program)) << "\nExit statuses:\n"
                  << table(exit_statuses());
    else if (given.count("version"))
        std::cout << program.name << " " << version() << "\n";
    else
        return std::nullopt;
    return exit_ok;
}

/// The number that the ports are moved by; nothing: it is no number.
std::optional<int> moved_ports(std::string const& text)
{
    int moved = 0;
    auto const [end, failed] = std::from_chars(text.data(), text.data() + text.size(), moved);
    if (failed != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return moved;
}

} // namespace

std::pair<std::optional<Arguments>, int> parse_arguments(int argc, char const* const* argv,
                                                         Program const& program)
{
    auto const shown = described(program);
    options::options_description all;
    all.add(shown).add_options()("config", options::value<std::vector<std::string>>());
    options::positional_options_description positions;
    positions.add("config", -1);

    options::variables_map given;
    try {
        options::store(options::command_line_parser(argc, argv).options(all).positional(positions).run(),
                       given);
    } catch (options::error const& failure) {
        std::cerr << program.name << ": " << terminal_text(failure.what()) << ". See " << program.name
                  << " --help.\n";
        return {std::nullopt, exit_usage};
    }
    // Whoever asks for help may have the rest wrong, so the rest is looked at only from here on.
    if (auto const printed = print_asked(program, given, shown))
        return {std::nullopt, *printed};
    auto const configs =
        given.count("config") ? given["config"].as<std::vector<std::string>>() : std::vector<std::string>();
    if (configs.size() > 1) {
        std::cerr << program.name << ": Too many arguments. Expected at most one configuration file, found "
                  << configs.size() << ".\n";
        return {std::nullopt, exit_usage};
    }
    Arguments arguments;
    arguments.config = configs.empty() ? find_default(program) : fs::path(configs.front());
    arguments.check_config = given.count("check-config") > 0;
    arguments.doctor = given.count("doctor") > 0;
    arguments.json = given.count("json") > 0;
    for (auto const& command : program.commands)
        if (given.count(command.option)) {
            arguments.command = command;
            if (!command.value.empty())
                arguments.command->target += core::percent_encode(given[command.option].as<std::string>());
        }
    bool const asks = arguments.command && arguments.command->table;
    if (arguments.json && !arguments.doctor && !asks) {
        std::cerr << program.name << ": --json is for --doctor"
                  << (program.kind == "session" ? " and --decisions.\n" : ".\n");
        return {std::nullopt, exit_usage};
    }
    if (given.count("move-ports")) {
        auto const& text = given["move-ports"].as<std::string>();
        auto const moved = moved_ports(text);
        if (!moved) {
            std::cerr << program.name << ": --move-ports: expected a number, found \"" << terminal_text(text)
                      << "\".\n";
            return {std::nullopt, exit_usage};
        }
        arguments.moved_ports = *moved;
    }
    if (given.count("log-format"))
        arguments.log_format = given["log-format"].as<std::string>();
    if (!arguments.log_format.empty() && arguments.log_format != "text" && arguments.log_format != "json") {
        std::cerr << program.name << ": --log-format: expected text or json, found \""
                  << terminal_text(arguments.log_format) << "\".\n";
        return {std::nullopt, exit_usage};
    }
    return {arguments, exit_ok};
}

std::optional<Logger> open_log(Program const& program, fs::path const& file, bool to_stdout, bool json,
                               std::vector<std::string> const& warnings)
{
    LogParams params;
    params.json = json;
    if (!to_stdout)
        params.file = file;
    auto log = make_logger(params);
    if (log) {
        for (auto const& warning : warnings)
            log->warning(warning);
        if (!to_stdout && ::isatty(STDERR_FILENO)) // somebody waits for it to say something
            std::cerr << program.name << ": What it does is logged to " << terminal_text(file.string())
                      << ". Ctrl-C ends it." << std::endl;
        return *log;
    }
    std::cerr << program.name << ": " << terminal_text(log.error().message()) << std::endl;
    return std::nullopt;
}

void print_failure(Program const& program, Failure const& failure)
{
    auto const lines = failure.message();
    for (auto const line : core::split(lines, '\n'))
        std::cerr << program.name << ": " << terminal_text(line) << std::endl;
}

void print_remarks(Program const& program, Arguments const& arguments,
                   std::vector<std::string> const& warnings, std::vector<std::string> const& notes,
                   bool is_usable)
{
    if (!arguments.command) // the running server has told them
        for (auto const& warning : warnings)
            std::cerr << program.name << ": warning: " << terminal_text(warning) << std::endl;
    if (!is_usable || !arguments.check_config)
        return;
    std::cout << terminal_text(arguments.config.string()) << ": good" << std::endl;
    for (auto const& note : notes)
        std::cout << terminal_text(note) << std::endl;
}

std::string terminal_text(std::string_view sentence)
{
    constexpr std::size_t max_sentence_length = 8192;
    return core::printable(sentence, max_sentence_length);
}

void report_findings(Arguments const& arguments, core::Findings const& findings)
{
    bool const coloured = ::isatty(STDOUT_FILENO) == 1 && !std::getenv("NO_COLOR");
    std::cout << (arguments.json ? core::findings_json(findings) + "\n"
                                 : core::findings_text(findings, coloured))
              << std::flush;
    // Threads of the doctor may still be at work (aside.hpp): nothing is torn down below them.
    std::quick_exit(is_asked_by_root() ? exit_ok : static_cast<int>(core::worst(findings)));
}

Progress shown_progress()
{
    if (::isatty(STDERR_FILENO) != 1)
        return {};
    return [](std::vector<std::string> const& subjects) {
        std::cerr << "\r\x1b[K";
        if (!subjects.empty())
            std::cerr << "Looking at " << core::join({subjects.begin(), subjects.end()}, ", ") << " ...\r";
        std::cerr << std::flush;
    };
}

} // namespace webots_cloud::app
