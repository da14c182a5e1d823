// Everything that can fail is looked at before the first server is started or stopped: configurations, files
// that have to be made, ports. After that a failure stops what this start has started (stop_again).
#include "start.hpp"

#include "adapters/process/program_output.hpp"
#include "answers.hpp"
#include "app/daemon.hpp"
#include "core/text.hpp"
#include "credentials.hpp"
#include "launch.hpp"
#include "log_folder.hpp"
#include "network.hpp"
#include "port_holder.hpp"
#include "process_table.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <algorithm>
#include <iostream>
#include <optional>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr Duration patience = std::chrono::seconds(30); // for a server to answer
// For a machine to be free: loads are means of 5 s, and asked for every 5 s.
constexpr Duration calm = std::chrono::seconds(15);
constexpr Duration silence = std::chrono::seconds(2); // before we say what we wait for

/// A server that this start has started.
struct Started
{
    Kind kind = Kind::session;
    Process process;
};

bool has_configuration(Kind kind, std::string const& name)
{
    std::error_code ignored; // a link that leads nowhere is a mistake, and not a server that nobody wants
    return fs::exists(fs::symlink_status(config_file(kind, name), ignored));
}

std::vector<std::string> command_of(Place const& place, Kind kind, int moved)
{
    std::vector<std::string> command{concat(place.programs, "/", program_of(kind))};
    if (moved != 0)
        command.push_back("--move-ports=" + std::to_string(moved));
    return command;
}

template<class Config>
std::vector<std::string> warnings_of(std::string const& file,
                                     result<Configured<Config>> (*parse)(std::string_view, fs::path const&))
{
    auto const text = app::read_config_file(file);
    auto configured = text ? parse(*text, file) : result<Configured<Config>>(text.error());
    if (!configured)
        return {};
    (void)app::check_files(*configured, file); // its errors have been told
    return std::move(configured->warnings);
}

/// What the server says itself when it starts.
std::vector<std::string> warnings_of(Kind kind, std::string const& file)
{
    return kind == Kind::session      ? warnings_of(file, parse_session_config)
           : kind == Kind::simulation ? warnings_of(file, parse_simulation_config)
                                      : std::vector<std::string>();
}

/// What keeps the server from its start, before what is only odd.
std::string errors_first(Kind kind, std::string_view said)
{
    auto const odd = concat(program_of(kind), ": warning: ");
    auto lines = core::split(core::trim(said), '\n');
    std::stable_partition(lines.begin(), lines.end(),
                          [&odd](std::string_view line) { return !line.starts_with(odd); });
    std::string text;
    for (auto const line : lines)
        text += concat(line, "\n");
    return text;
}

/// What can't be reached from here now is found out by the server, and by its doctor.
result<> check_configuration(Place const& place, Kind kind, std::string const& file, int moved)
{
    auto command = command_of(place, kind, moved);
    command.emplace_back("--check-config");
    command.push_back(file);
    auto const end = adapters::run_program(command, patience);
    if (!end)
        return end.error();
    return end->status == 0 ? result<>()
                            : result<>(Failure(errc::invalid_config, errors_first(kind, end->output)));
}

result<Settings> prepare_server(Place const& place, Kind kind, std::string const& file, int moved)
{
    auto settings = read_settings(kind, file, moved);
    if (settings && kind != Kind::website_host)
        if (auto const made = make_certificate(*settings); !made)
            return made.error();
    if (settings)
        for (auto const& made : {make_teacher_password(*settings), make_operator_token(*settings)})
            if (!made)
                return made.error();
    // It says all that is wrong, and what of it is only odd.
    if (auto const good = check_configuration(place, kind, file, moved); !good)
        return good.error();
    if (settings)
        settings->warnings = warnings_of(kind, file);
    return settings;
}

/// A server that runs is left as it is, if it is what is wanted.
result<> compare(StartedSite const& site, Settings const& settings, Process const& running)
{
    auto const server = parse_server(running.arguments);
    auto const name = server ? name_of(*server) : std::string();
    if (name == site.name && server->moved == site.moved)
        return {};
    auto const who = with_number(concat("The ", called(settings.kind)), running.id);
    auto const theirs =
        read_settings(settings.kind, config_file(settings.kind, name), server ? server->moved : 0);
    auto const where =
        name == site.name && theirs ? " on port " + std::to_string(theirs->address.port) : std::string();
    return Failure(errc::refused, concat(who, " runs with ", config_file(settings.kind, name), where,
                                         ": stop it first, or use restart."));
}

PortUse use_of(StartedSite const& site, Settings const& settings, std::uint16_t port)
{
    PortUse use;
    use.kind = settings.kind;
    use.name = site.name;
    use.is_redirect = port == settings.redirect_port;
    use.has_session = has_configuration(Kind::session, site.name);
    use.has_website = has_configuration(Kind::website_host, site.name);
    use.site_port = site.servers.back().address.port; // of the session server, if there is one
    return use;
}

result<> find_free_ports(StartedSite const& site, Settings const& settings)
{
    for (auto const port : ports_of(settings))
        if (is_taken(settings.listen_address, port))
            return Failure(errc::unavailable,
                           port_taken(settings, site.name, port, other_ports(use_of(site, settings, port))));
    int const first = settings.address.port + 1;
    int const end = first + settings.simulation_ports;
    int taken = first;
    while (taken < end && is_taken(settings.listen_address, static_cast<std::uint16_t>(taken)))
        ++taken;
    if (taken == first || taken < end) // other simulations may have those of a machine
        return {};
    return Failure(errc::unavailable,
                   concat("All ports of simulations, ", std::to_string(first), " to ",
                          std::to_string(end - 1), ", are in use by other programs: ", site.name, " ",
                          called(settings.kind), " not started. End these programs; or ",
                          other_ports(use_of(site, settings, settings.address.port)), "."));
}

/// Of each server of the site, in its order: the process that runs already.
result<std::vector<std::optional<Process>>> look_around(Place const& place, StartedSite const& site)
{
    std::vector<std::optional<Process>> running;
    for (auto const& settings : site.servers) {
        auto process = known_server(place, settings.kind);
        if (!process)
            return process.error();
        auto const usable = *process ? compare(site, settings, **process) : find_free_ports(site, settings);
        if (!usable)
            return usable.error();
        running.push_back(std::move(*process));
    }
    return running;
}

/// With what it has said, as far as the logs know.
Failure gave_up(Settings const& settings, std::string const& sentence)
{
    return {errc::start_failed, concat(sentence, " It said:\n", last_words(settings.kind, settings.log_dir))};
}

/// With its reason before all else that it has said.
Failure ended_at_once(Settings const& settings)
{
    auto const reason = reason_of_end(settings.kind);
    return gave_up(settings,
                   concat("The ", called(settings.kind), " ended at once",
                          reason.empty() ? "." : concat(": ", reason, reason.ends_with('?') ? "" : ".")));
}

result<> await_answer(Settings const& settings, Process const& process)
{
    auto const deadline = std::chrono::steady_clock::now() + patience;
    while (!answers(settings)) {
        if (!is_alive(process))
            return ended_at_once(settings);
        if (is_interrupted())
            return Failure(errc::closed, "Interrupted.");
        if (std::chrono::steady_clock::now() >= deadline)
            return gave_up(settings,
                           concat(with_number(concat("The ", called(settings.kind)), process.id),
                                  " does not answer on port ", std::to_string(settings.address.port), "."));
        pause_a_moment();
    }
    return {};
}

result<> start_server(Place const& place, StartedSite const& site, Settings const& settings,
                      std::vector<Started>& started)
{
    auto const console = open_console(settings.kind);
    if (!console)
        return console.error();
    auto command = command_of(place, settings.kind, site.moved);
    command.push_back(settings.file);
    auto const id = start_detached(command, *console);
    if (!id)
        return id.error();
    auto const process = read_process(*id);
    if (!process)
        return ended_at_once(settings);
    started.push_back({settings.kind, *process});
    if (auto const noted = note_process(settings.kind, *id); !noted)
        std::cerr << app::terminal_text(noted.error().message()) << std::endl; // it is found without
    if (auto const answered = await_answer(settings, *process); !answered)
        return answered;
    std::cout << with_number(concat("Started ", site.name, " ", called(settings.kind)), *id) << std::endl;
    return {};
}

/// Nothing half is left.   Returns: why, and what was stopped.
Failure stop_again(std::vector<Started> const& started, Failure const& why)
{
    auto text = why.message();
    for (auto each = started.rbegin(); each != started.rend(); ++each) {
        bool const was_alive = is_alive(each->process);
        auto const stopped = stop_server(each->kind, each->process);
        if (!text.ends_with('\n'))
            text += '\n';
        if (!stopped)
            text += stopped.error().message();
        else if (was_alive)
            text += concat(with_number(concat("Stopped the ", called(each->kind)), each->process.id),
                           " again, which this start had started.");
    }
    return {why.code(), text};
}

/// Whoever is told the address can start a simulation: the session server has heard of a machine that is
/// free. One that has just built all this may be busy for a moment.
void await_machine(Settings const& session)
{
    auto const begin = std::chrono::steady_clock::now();
    bool is_told = false;
    while (!has_room(session) && !is_interrupted()) {
        auto const waited = std::chrono::steady_clock::now() - begin;
        if (waited >= calm) {
            std::cout << "No simulation server is free yet: " << site_address(session)
                      << "monitor shows their loads. The page says when one is." << std::endl;
            return;
        }
        if (!is_told && waited >= silence) {
            is_told = true;
            std::cout << "Waiting until a simulation server is free" << std::endl;
        }
        pause_a_moment();
    }
}

} // namespace

result<> find_configurations(std::string const& name)
{
    if (has_configuration(Kind::session, name) || has_configuration(Kind::simulation, name))
        return {};
    return Failure(errc::not_found, concat("Expected the name of a configuration, found \"", name,
                                           "\": there is neither ", config_file(Kind::session, name), " nor ",
                                           config_file(Kind::simulation, name), "."));
}

result<int> moved_ports(Place const& place, std::string const& name, std::uint16_t port)
{
    if (auto const found = find_configurations(name); !found)
        return found.error();
    if (port == 0) {
        for (auto const kind : start_order)
            if (auto const process = running_server(place, kind))
                if (auto const server = parse_server(process->arguments); server && name_of(*server) == name)
                    return server->moved;
        return 0;
    }
    auto const kind = has_configuration(Kind::session, name) ? Kind::session : Kind::simulation;
    auto const settings = read_settings(kind, config_file(kind, name), 0);
    return settings ? port - settings->address.port : 0; // what is wrong with it is told by the server
}

result<StartedSite> prepare(Place const& place, std::string const& name, int moved)
{
    StartedSite site;
    site.name = name;
    site.moved = moved;
    for (auto const kind : start_order) {
        if (!has_configuration(kind, name))
            continue;
        auto settings = prepare_server(place, kind, config_file(kind, name), moved);
        if (!settings)
            return settings.error();
        site.servers.push_back(std::move(*settings));
    }
    return site;
}

result<> start_servers(Place const& place, StartedSite const& site)
{
    auto const running = look_around(place, site);
    if (!running)
        return running.error();
    std::vector<Started> started;
    for (std::size_t i = 0; i < site.servers.size(); ++i) {
        auto const& settings = site.servers[i];
        if (auto const& process = (*running)[i]) {
            std::cout << with_number(
                             concat("The ", site.name, " ", called(settings.kind), " is already running"),
                             process->id)
                      << std::endl;
            continue;
        }
        auto const done = start_server(place, site, settings, started);
        if (done)
            continue;
        return stop_again(started, done.error());
    }
    auto const& last = site.servers.back();
    if (!started.empty() && last.kind == Kind::session && last.hears_machines &&
        has_configuration(Kind::simulation, site.name))
        await_machine(last);
    return {};
}

std::string first_line_of_ours(fs::path const& file)
{
    constexpr std::size_t max_password = 4096;
    if (file.begin() == file.end() || *file.begin() != "log")
        return {};
    auto const text = read_regular_file(file, max_password);
    return text ? text->substr(0, text->find_first_of("\r\n")) : std::string();
}

} // namespace webots_cloud::site
