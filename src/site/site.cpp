// The verbs of webots-site. What is running is found by running.cpp, a start is in start.cpp; here they are
// put together, and what people read is printed.
#include "site.hpp"

#include "adapters/host/epoll_watches.hpp"
#include "adapters/process/program_output.hpp"
#include "answers.hpp"
#include "app/daemon.hpp"
#include "app/environment.hpp"
#include "app/own_limits.hpp"
#include "command_line.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "launch.hpp"
#include "log_folder.hpp"
#include "process_table.hpp"
#include "running.hpp"
#include "start.hpp"

#include <webots_cloud/adapters/host.hpp>

#include <filesystem>
#include <iostream>

#include <unistd.h>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr int exit_not_running = 3; // as systemctl

int print_failure(Failure const& failure)
{
    auto const text = failure.message();
    for (auto const line : core::split(core::trim(text), '\n'))
        std::cerr << app::terminal_text(line) << std::endl;
    return app::exit_failed;
}

void say(std::string_view line)
{
    std::cout << app::terminal_text(line) << std::endl;
}

std::string none_runs(std::string_view name)
{
    return concat("No ", name, name.empty() ? "" : " ", "server is running");
}

/// What the session server of this folder runs with; nothing: none runs.
std::optional<Settings> running_session(Place const& place)
{
    auto const process = running_server(place, Kind::session);
    auto const server = process ? parse_server(process->arguments) : std::nullopt;
    if (!server)
        return std::nullopt;
    auto settings = read_settings(Kind::session, server->configuration, server->moved);
    return settings ? std::optional(std::move(*settings)) : std::nullopt;
}

/// `session`: of the same folder; null: none runs.
void show_status(Kind kind, Process const& process, ServerCommand const& server, Settings const* session)
{
    say(concat("The ", called(kind), " runs since ",
               with_number(core::local_time(beginning_of(process)), process.id)));
    auto const moved = server.moved == 0 ? "" : concat(", its ports moved by ", std::to_string(server.moved));
    say(concat("  configuration  ", config_file(kind, name_of(server)), moved));
    auto const settings = read_settings(kind, server.configuration, server.moved);
    if (!settings) {
        say(concat("  It can't be read any more: ", settings.error().message()));
        return;
    }
    if (kind == Kind::simulation) // it has no other page
        say(concat("  address        ", machine_address(*settings, session), "monitor"));
    else
        say(concat("  address        ", site_address(*settings)));
    say(concat("  logs           ", settings->log_dir.string(), "/", word_of(kind)));
    for (auto const& line : state_lines(*settings))
        say("  " + line);
    if (kind == Kind::simulation)
        for (auto const& line : failed_starts(settings->log_dir, beginning_of(process)))
            say("  failed start   " + line);
}

/// Changes nothing, so it waits for nobody.
int show_all(Place const& place, std::string const& name)
{
    bool is_any = false;
    auto const session = running_session(place);
    for (auto const kind : status_order) {
        auto const process = running_server(place, kind);
        auto const server = process ? parse_server(process->arguments) : std::nullopt;
        if (!server || (!name.empty() && name_of(*server) != name))
            continue;
        is_any = true;
        show_status(kind, *process, *server, session ? &*session : nullptr);
    }
    if (!is_any)
        say(none_runs(name));
    return is_any ? app::exit_ok : exit_not_running;
}

result<> stop_all(Place const& place, std::string const& name)
{
    bool is_any = false;
    for (auto const kind : stop_order) {
        auto const process = known_server(place, kind);
        if (!process)
            return process.error();
        if (!*process || (!name.empty() && name_of(*parse_server((*process)->arguments)) != name))
            continue;
        if (auto const stopped = stop_server(kind, **process); !stopped)
            return stopped;
        is_any = true;
        say(with_number(concat("Stopped ", called(kind)), (*process)->id));
    }
    if (!is_any)
        say(none_runs(name));
    return {};
}

result<> refuse_running(Place const& place)
{
    for (auto const kind : {Kind::session, Kind::simulation})
        if (running_server(place, kind))
            return Failure(
                errc::refused,
                concat("The ", called(kind), " of this folder runs, and has the ports: ./server.sh stop"));
    return {};
}

void show_class(Settings const& session)
{
    if (!session.has_classes)
        return;
    auto const addresses =
        is_for_this_machine(session) ? std::vector<std::string>() : shared_ipv4_addresses();
    say(concat("For a class: ", site_address(session, addresses.empty() ? "localhost" : addresses.back()),
               "class/"));
    auto const& file = session.teacher_password_file;
    auto const password = first_line_of_ours(file);
    if (!password.empty())
        say(concat("Password of teachers: ", password, " (in ", file.string(), ")"));
}

/// For phones, on a terminal, where the program for it is installed.
void show_code(std::string const& address)
{
    constexpr Duration limit = std::chrono::seconds(10);
    auto const qrencode = ::isatty(STDOUT_FILENO) == 1 ? app::find_program("qrencode") : fs::path();
    if (qrencode.empty())
        return;
    if (auto const code = adapters::run_program({qrencode.string(), "-t", "ANSIUTF8", address}, limit);
        code && code->status == 0)
        std::cout << code->output << std::flush;
}

/// Of a site without a name, where the other machines of our networks find it.
void show_network_addresses(Settings const& session)
{
    std::string last;
    for (auto const& own : shared_ipv4_addresses()) {
        last = site_address(session, own);
        say("From other machines of the network: " + last);
    }
    if (last.empty()) {
        say("This machine is in no network: others can't reach it.");
        return;
    }
    show_code(last);
    say(concat("If they can't reach it, a firewall keeps them out: port ",
               std::to_string(session.address.port), " has to be open."));
}

/// Whether this folder has a site for the other machines of the network.
bool has_network_site()
{
    std::error_code ignored;
    return fs::exists(config_file(Kind::session, "lan"), ignored);
}

void show_addresses(StartedSite const& site)
{
    for (auto const& settings : site.servers)
        if (settings.kind == Kind::simulation)
            if (auto const weak = weakness(settings); !weak.empty())
                say("Warning: " + weak);
    for (auto const& settings : site.servers)
        if (settings.kind == Kind::session) {
            say(concat("Open ", site_address(settings)));
            if (settings.address.host == "*")
                show_network_addresses(settings);
            else if (is_for_this_machine(settings) && has_network_site())
                say("Only browsers on this machine reach it. For others in the network: "
                    "./server.sh restart --lan");
            show_class(settings);
        }
    for (auto const& settings : site.servers)
        if (settings.kind == Kind::website_host)
            say("A website with an editor: " + site_address(settings));
}

/// The token itself is for nobody who looks over a shoulder.
void show_token(StartedSite const& site)
{
    for (auto const& settings : site.servers)
        if (auto const& file = settings.operator_token_file; !first_line_of_ours(file).empty()) {
            say(concat("The operator's token, for the button Operator of the monitor: in ", file.string()));
            return;
        }
}

result<> start_all(Place const& place, CommandLine const& line, bool stops_before)
{
    if (auto const found = adapters::find_watches(); !found) // before anything is stopped
        return found;
    auto const name = line.name.empty() ? std::string("local") : line.name;
    auto const moved = moved_ports(place, name, line.port);
    if (!moved)
        return moved.error();
    auto site = prepare(place, name, *moved);
    if (!site)
        return site.error();
    if (stops_before)
        if (auto const stopped = stop_all(place, {}); !stopped)
            return stopped;
    for (auto const& settings : site->servers)
        for (auto const& warning : settings.warnings)
            say("Warning: " + warning);
    if (auto const started = start_servers(place, *site); !started)
        return started;
    show_addresses(*site);
    show_token(*site);
    return {};
}

/// What none of our files and configurations can change.
result<> check_environment(Verb verb)
{
    std::error_code ignored;
    if (!fs::exists("/proc/self", ignored))
        return Failure(errc::unavailable, "Servers can't be watched or stopped without /proc. As root, run: "
                                          "mount -t proc proc /proc");
    if (are_hidden())
        return Failure(errc::unavailable,
                       "Servers can't be watched or stopped from here, because /proc hides the processes of "
                       "others (its option hidepid), and with them our servers. Run this as root, or let "
                       "root allow it with: mount -o remount,hidepid=0 /proc");
    bool const starts = verb == Verb::ready || verb == Verb::start || verb == Verb::restart;
    return starts ? app::check_limits(app::own_limits()) : result<>();
}

result<> obey(Place const& place, CommandLine const& line)
{
    if (line.verb == Verb::idle)
        return refuse_running(place);
    if (line.verb == Verb::ready) {
        auto const writable = open_log_folder();
        return writable ? find_configurations(line.name.empty() ? "local" : line.name) : writable;
    }
    if (auto const locked = lock_site(); !locked) // one of us at a time
        return locked;
    return line.verb == Verb::stop ? stop_all(place, line.name)
                                   : start_all(place, line, line.verb == Verb::restart);
}

} // namespace

int run(std::vector<std::string_view> const& arguments)
{
    open_standard_files();
    take_signals();
    auto const line = parse_command_line(arguments);
    if (!line.complaint.empty()) {
        std::cerr << "webots-site: " << app::terminal_text(line.complaint) << std::endl;
        return app::exit_usage;
    }
    if (line.verb == Verb::help) {
        std::cout << help_text() << std::flush;
        return app::exit_ok;
    }
    std::error_code failed;
    Place place;
    place.folder = fs::current_path(failed).string();
    place.programs = place.folder + "/build/release/bin";
    if (failed)
        return print_failure(Failure(errc::unavailable, "This folder is gone: " + failed.message()));
    if (auto const possible = check_environment(line.verb); !possible)
        return print_failure(possible.error());
    if (line.verb == Verb::status)
        return show_all(place, line.name);
    auto const done = obey(place, line);
    return done ? app::exit_ok : print_failure(done.error());
}

} // namespace webots_cloud::site
