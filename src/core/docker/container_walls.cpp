// Writes a second compose file that takes capabilities, networks and displays away from what the operator's
// grants. The services are found by indentation: where that fails, the simulation does not start.
#include "container_walls.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view display_folder = "/tmp/.X11-unix";
// Its image is nobody's here, and may need to become another user at its start.
constexpr std::string_view editor = "theia";
// The participant's program in a competition, which speaks with the simulator through files.
constexpr std::string_view controller = "controller";
// Docker keeps what a container prints in a file of its own, without a limit unless there is one.
constexpr std::string_view log_limit =
    "    logging:\n      driver: json-file\n      options: {max-size: 1m, max-file: \"2\"}\n";

std::size_t indentation(std::string_view line)
{
    auto const first = line.find_first_not_of(' ');
    return first == std::string_view::npos ? line.size() : first;
}

bool is_blank(std::string_view line)
{
    auto const words = trim(line);
    return words.empty() || words.front() == '#';
}

/// A service of a compose file, and its lines.
struct Service
{
    std::string name;
    std::string text;
};

std::string_view without_quotes(std::string_view key)
{
    bool const quoted =
        key.size() > 2 && (key.front() == '"' || key.front() == '\'') && key.back() == key.front();
    return quoted ? key.substr(1, key.size() - 2) : key;
}

std::vector<Service> services_of(std::string_view compose_file)
{
    std::vector<Service> services;
    bool inside = false;
    std::size_t depth = 0; // of the names; 0: there was none yet
    for (auto const line : split(compose_file, '\n')) {
        if (is_blank(line))
            continue;
        auto const indented = indentation(line);
        if (indented == 0) {
            inside = trim(line) == "services:";
            continue;
        }
        if (!inside)
            continue;
        if (depth == 0)
            depth = indented;
        if (indented > depth) {
            if (!services.empty())
                services.back().text.append(line).append("\n");
            continue;
        }
        auto key = trim(line);
        key = key.substr(0, key.find(':')); // an anchor may follow
        services.emplace_back();
        services.back().name = without_quotes(trim(key));
    }
    return services;
}

/// Compose 1 wants the same version in all files.
std::string_view version_line(std::string_view compose_file)
{
    for (auto const line : split(compose_file, '\n'))
        if (line.starts_with("version:"))
            return trim(line);
    return {};
}

/// Lines of a service that has mounted the folder with the sockets of all displays: in its place it gets an
/// empty one, and there the socket that it may use.
std::string display_lines(std::filesystem::path const& socket)
{
    auto text = concat("    volumes:\n      - type: tmpfs\n        target: ", display_folder, "\n");
    if (!socket.empty())
        text.append(concat("      - type: bind\n        source: ", socket.native(),
                           "\n        target: ", socket.native(), "\n        read_only: true\n"));
    return text;
}

/// Lines of a service. Compose 2 refuses a file with options that the operator's has, too.
std::string security_lines(std::string_view operators, bool system_calls)
{
    constexpr std::string_view no_gain = "no-new-privileges:true";
    std::string text;
    if (operators.find(no_gain) == std::string_view::npos)
        text.append(concat("      - ", no_gain, "\n"));
    if (system_calls && operators.find("seccomp") == std::string_view::npos)
        text.append(concat("      - seccomp:", system_calls_file_name, "\n"));
    return text.empty() ? text : concat("    security_opt:\n", text);
}

/// Lines of a service. There is no swap besides the memory, as without containers.
std::string limit_lines(ProcessLimits const& limits)
{
    std::string text;
    auto const add = [&text](std::string_view key, std::string const& value) {
        text.append(concat("    ", key, ": ", value, "\n"));
    };
    if (limits.memory > 0) {
        add("mem_limit", std::to_string(limits.memory));
        add("memswap_limit", std::to_string(limits.memory));
    }
    if (limits.processors > 0)
        add("cpus", python_float(limits.processors));
    if (limits.processes > 0)
        add("pids_limit", std::to_string(limits.processes));
    if (limits.files > 0 || limits.disk > 0)
        text.append("    ulimits:\n");
    if (limits.files > 0)
        add("  nofile", std::to_string(limits.files));
    if (limits.disk > 0)
        add("  fsize", std::to_string(limits.disk));
    return text;
}

} // namespace

std::vector<std::string> compose_services(std::string_view compose_file)
{
    std::vector<std::string> names;
    for (auto& service : services_of(compose_file))
        names.push_back(std::move(service.name));
    return names;
}

bool chooses_network(std::string_view compose_file)
{
    auto const services = services_of(compose_file);
    return std::any_of(services.begin(), services.end(), [](auto const& service) {
        return service.name == simulator_service &&
               (service.text.find("network_mode:") != std::string::npos ||
                service.text.find("networks:") != std::string::npos);
    });
}

std::string walls_file(std::string_view compose_file, ContainerWalls const& walls)
{
    auto text = concat(version_line(compose_file), "\nservices:\n");
    for (auto const& [name, lines] : services_of(compose_file)) {
        text.append(concat("  ", name, ":\n"));
        text.append(name == editor ? "    cap_drop: [MKNOD, NET_RAW]\n" : "    cap_drop: [ALL]\n");
        text.append(security_lines(lines, walls.system_calls && name != editor));
        bool const is_closed = (walls.builds_without_network && name == simulator_service) ||
                               (walls.controller_builds_without_network && name == controller);
        if (is_closed && lines.find("build:") != std::string::npos &&
            lines.find("network:") == std::string::npos)
            text.append("    build:\n      network: none\n");
        if (!walls.token.empty() && name == simulator_service)
            text.append(concat("    labels:\n      ", simulator_label, ": \"", walls.token, "\"\n"));
        if (walls.own_network && (name == simulator_service || name == controller))
            text.append("    network_mode: none\n");
        if (walls.own_network && name == simulator_service && !walls.name_server.empty())
            text.append(concat("    dns: [", walls.name_server, "]\n"));
        // Xvfb does not tell a first process that it is ready, and `xvfb-run` would wait for that forever.
        if (walls.own_display && name == simulator_service)
            text.append("    init: true\n");
        text.append(limit_lines(walls.limits));
        if (walls.limits.disk > 0 && lines.find("logging:") == std::string::npos)
            text.append(log_limit);
        if (lines.find(display_folder) != std::string::npos)
            text.append(display_lines(walls.display_socket));
    }
    return text;
}

} // namespace webots_cloud::core
