// What both programs need around their servers: arguments, configuration files, signals, exit codes.
#pragma once

#include "core/doctor/finding.hpp"
#include "doctor/examination.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::app {

/// A request that the operator makes of a running server with an option of its program.
struct OperatorCommand
{
    OperatorCommand() = default;
    OperatorCommand(std::string option, std::string summary, std::string method, std::string target)
        : option(std::move(option)), summary(std::move(summary)), method(std::move(method)),
          target(std::move(target))
    {}

    OperatorCommand(std::string option, std::string value, std::string summary, std::string method,
                    std::string target)
        : option(std::move(option)), value(std::move(value)), summary(std::move(summary)),
          method(std::move(method)), target(std::move(target))
    {}

    std::string option; ///< Without dashes.
    std::string value;  ///< What follows it, for `--help`; empty: nothing does.
    std::string summary;
    std::string method;
    std::string target; ///< The value, percent-encoded, is appended to it.
    /// The answer, which is JSON, as people read it; null: it is printed as it is.
    std::string (*table)(std::string_view answer) = nullptr;
};

/// What a program is called and does, for `--help`.
struct Program
{
    Program() = default;

    std::string name;                     ///< For instance "webots-session-server".
    std::string kind;                     ///< `session` or `simulation`.
    std::string summary;                  ///< One sentence.
    std::filesystem::path default_config; ///< Relative to the working directory, or to the installation.
    std::vector<OperatorCommand> commands;
};

Program session_server_program();
Program simulation_server_program();

/// The command line, understood.
struct Arguments
{
    Arguments() = default;

    std::filesystem::path config;           ///< The file to read.
    bool check_config = false;              ///< Read it, say what is wrong, and stop.
    bool doctor = false;                    ///< Look at everything that an operator can get wrong, and stop.
    bool json = false;                      ///< What `doctor` finds, or `command` is told, is for programs.
    std::string log_format;                 ///< `text` or `json`; empty: what the file says.
    int moved_ports = 0;                    ///< Added to the ports of the file: see `move_ports`.
    std::optional<OperatorCommand> command; ///< Ask the server that runs with this configuration, and stop.
};

/// Exit statuses of both programs.
inline constexpr int exit_ok = 0;
inline constexpr int exit_failed = 1; ///< It ran and could not go on.
inline constexpr int exit_usage = 2;  ///< Arguments or configuration are unusable: it did not start.
/// A port is in use, or something else is missing that may come: it did not start, but may the next time.
inline constexpr int exit_try_again = 3;

/// Understands a command line; prints what `--help` and `--version` ask for, or what is wrong.
///
/// Returns an exit status instead of arguments when the program is to end at once.
std::pair<std::optional<Arguments>, int> parse_arguments(int argc, char const* const* argv,
                                                         Program const& program);

/// Asks the server that runs on this machine with this port and configuration for what `arguments.command`
/// says, prints its answer or why there is none, and returns an exit status.
int ask_running_server(Program const& program, Arguments const& arguments, std::uint16_t port,
                       AccessConfig const& access);

/// For `--doctor`: reads the configuration, looks at everything that an operator can get wrong, and changes
/// nothing. Takes some ten seconds at most.
core::Findings diagnose_session_server(Arguments const& arguments, Progress progress);
/// `programs` as for `serve_simulations`.
core::Findings diagnose_simulation_server(Arguments const& arguments, std::filesystem::path const& programs,
                                          Progress progress);

/// On a terminal.
Progress shown_progress();

/// Prints a line for each thing that was found, and ends the program with an exit status: `exit_ok`, 1 where
/// there are warnings, 2 where something does not work.
[[noreturn]] void report_findings(Arguments const& arguments, core::Findings const& findings);

/// A sentence as a terminal may get it: in one line, and without what would steer it, whatever files and
/// arguments are called.
std::string terminal_text(std::string_view sentence);

/// The contents of the configuration file.
/// Errors: `invalid_config`, naming the file and the reason.
result<std::string> read_config_file(std::filesystem::path const& path);

/// Opens the log of a program and prints what is wrong with it, if anything; in a terminal, where it is. Its
/// first lines are `warnings`, those of the configuration.
std::optional<Logger> open_log(Program const& program, std::filesystem::path const& file, bool to_stdout,
                               bool json, std::vector<std::string> const& warnings = {});

/// Adds `distance` to every port of a site that is on this machine: the server's own ones, and those at which
/// a session server finds simulation servers of this machine. So one number moves a whole site.
///
/// Errors: `invalid_argument`: one of them would be no port.
result<> move_ports(SessionConfig& config, int distance);
result<> move_ports(SimulationConfig& config, int distance);

/// Reads and parses a configuration; the command line has the last word.
/// Errors: `invalid_config`.
template<class Config>
result<Configured<Config>> read_config(Arguments const& arguments,
                                       result<Configured<Config>> (*parse)(std::string_view,
                                                                           std::filesystem::path const&))
{
    auto const text = read_config_file(arguments.config);
    if (!text)
        return text.error();
    auto configured = parse(*text, arguments.config);
    if (configured && !arguments.log_format.empty())
        configured->config.json_log = arguments.log_format == "json";
    if (configured)
        if (auto const moved = move_ports(configured->config, arguments.moved_ports); !moved)
            return moved.error();
    return configured;
}

/// Looks at the files and folders of this computer that a configuration names, and adds what an operator
/// should know of them to its warnings. `origin` is the configuration's file, for messages.
///
/// Errors: `invalid_config`: nothing works without one that is unusable.
result<> check_files(Configured<SessionConfig>& configured, std::filesystem::path const& origin);
result<> check_files(Configured<SimulationConfig>& configured, std::filesystem::path const& origin);

/// The same for what a server with this configuration would use besides: the folders that it writes into, its
/// ports, and the names of other hosts. Changes nothing; takes four seconds at most.
///
/// Errors: `invalid_config`: the server would not start.
result<> check_surroundings(Configured<SessionConfig>& configured, std::filesystem::path const& origin);
result<> check_surroundings(Configured<SimulationConfig>& configured, std::filesystem::path const& origin);

/// Prints why a program can't go on, on standard error, a line for each line of the sentence.
void print_failure(Program const& program, Failure const& failure);

/// Prints the warnings of a configuration and, with `check_config`, that it is good, with its notes.
void print_remarks(Program const& program, Arguments const& arguments,
                   std::vector<std::string> const& warnings, std::vector<std::string> const& notes,
                   bool is_usable);

/// Reads a configuration and prints everything that is wrong with it, or else with the files that it names,
/// on standard error; with `check_config` also with what the server would use besides.
///
/// Returns an exit status instead when the program is to end at once.
template<class Config>
std::pair<std::optional<Configured<Config>>, int>
load_config(Program const& program, Arguments const& arguments,
            result<Configured<Config>> (*parse)(std::string_view, std::filesystem::path const&))
{
    auto configured = read_config(arguments, parse);
    auto usable = configured ? check_files(*configured, arguments.config) : result<>(configured.error());
    if (usable && arguments.check_config)
        usable = check_surroundings(*configured, arguments.config);
    if (configured)
        print_remarks(program, arguments, configured->warnings, configured->notes, usable.has_value());
    if (!usable) {
        print_failure(program, usable.error());
        return {std::nullopt, exit_usage};
    }
    if (arguments.check_config)
        return {std::nullopt, exit_ok};
    return {std::move(*configured), exit_ok};
}

/// For the program of a session server, before it has other threads: from now on it can open only the files
/// that such a server needs, and start no programs.
///
/// Errors: `unavailable`: the kernel can't do that; everything goes on as before.
result<> confine_session_server(SessionConfig config, std::filesystem::path const& config_file);

/// Runs `body` on one thread, which answers promptly, until it ends, or until SIGTERM or SIGINT cancel it.
/// From then on nobody but root can trace this process, and it leaves no core. `log` is told what ends it.
///
/// Returns `exit_ok` when it was cancelled, and otherwise prints why it ended, after `name`, and returns
/// `exit_try_again` for `unavailable`, `exit_usage` for `invalid_config` and `invalid_argument`, and
/// `exit_failed` for everything else.
int run_daemon(std::string const& name,
               std::function<boost::asio::awaitable<result<>>(boost::asio::any_io_executor)> body,
               Logger log = Logger());

/// The folder of the running program, for what is installed beside it.
std::filesystem::path program_folder();

} // namespace webots_cloud::app
