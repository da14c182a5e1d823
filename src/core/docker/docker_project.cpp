// Decides how a project runs in containers: image, compose file, and the values that both get. What a
// stranger can choose ends up in files that compose and shells read, so only harmless characters pass.
#include "docker_project.hpp"

#include "characters.hpp"
#include "container_walls.hpp"
#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/text.hpp"
#include "labels.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

/// Nothing that means something between quotes: neither in `.env`, where compose looks for `$`, `\` and `"`,
/// nor to those who split command lines.
bool is_harmless_world_name(std::string_view name)
{
    return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
        return is_letter(c) || is_digit(c) || static_cast<unsigned char>(c) >= 0x80 ||
               std::string_view(" _.-+@,()='&#[]%!").find(c) != std::string_view::npos;
    });
}

/// The folder below `/usr/local/` that a path relative to it leads to, as Docker resolves it: official
/// competitions have `../../../usr/local/webots-project/controllers/`.   Empty: it leads elsewhere, or has
/// characters that mean something to compose.
std::string harmless_folder(std::string_view folder)
{
    constexpr std::string_view base = "/usr/local/";
    if (folder.empty() || folder.size() > 200 || folder.front() == '/' || !consists_of(folder, "_.-/"))
        return {};
    auto const path = std::filesystem::path(concat(base, folder)).lexically_normal().string();
    return path.starts_with(base) ? path.substr(base.size()) : std::string();
}

/// Of images, displays and devices.
bool is_harmless_name(std::string_view text)
{
    return text.size() <= 300 && consists_of(text, "_.-/:@");
}

/// One word of a command line within a value in double quotes.
std::string quoted_world_path(std::string_view world)
{
    auto const path = concat(project_in_container, "/worlds/", world);
    if (consists_of(world, "_.-"))
        return path;
    std::string_view const quote = world.find('\'') == std::string_view::npos ? "'" : "\\\"";
    return concat(quote, path, quote);
}

std::string webots_in_container_command(DockerEnvironment const& environment)
{
    auto argv = webots_command(webots_in_container, environment.stream_mode, environment.port, {},
                               environment.names_extern_robots);
    argv.back() = quoted_world_path(environment.world);
    if (environment.own_display)
        argv.insert(argv.begin(), {"xvfb-run", "--auto-servernum"});
    return join({argv.begin(), argv.end()}, " ");
}

result<> read_docker_compose(std::string_view line, WebotsYml& yml)
{
    auto const fields = split(line, ':');
    auto const kind = trim(fields[1]);
    if (kind.starts_with("theia"))
        yml.kind = ComposeTemplate::theia;
    else if (kind == "competition")
        yml.kind = ComposeTemplate::competition;
    else
        return {};
    auto folder = harmless_folder(fields.size() < 3 ? std::string_view() : trim(fields[2]));
    if (folder.empty())
        return refused(Refused::wrong_compose_line, {{"line", printable(trim(line), 100)},
                                                     {"kind", kind == "competition" ? kind : "theia"}});
    yml.volume = std::move(folder);
    yml.messages.emplace_back(editor_message);
    return {};
}

std::string type_message(std::string_view line)
{
    std::string type(trim(line));
    std::erase(type, ' ');
    return printable(type, 100) + "\n";
}

constexpr std::array<std::string_view, 16> passed_on = {
    "HOME",        "LANG",     "LOGNAME",         "PATH",           "SSH_AUTH_SOCK", "TMPDIR",
    "TZ",          "USER",     "http_proxy",      "https_proxy",    "no_proxy",      "HTTP_PROXY",
    "HTTPS_PROXY", "NO_PROXY", "XDG_CONFIG_HOME", "XDG_RUNTIME_DIR"};

std::vector<std::string> compose_command(std::vector<std::string> compose, std::filesystem::path const& file,
                                         std::vector<std::string> const& arguments)
{
    compose.emplace_back("-f");
    compose.push_back(file.string());
    compose.emplace_back("-f");
    compose.push_back((file.parent_path() / walls_file_name).string());
    compose.insert(compose.end(), arguments.begin(), arguments.end());
    return compose;
}

} // namespace

result<std::string> default_docker_image(std::string_view repository, std::string_view world_header)
{
    auto const words = split(world_header, ' ');
    auto const version = words.size() < 2 ? std::string_view() : trim(words[1]);
    if (words[0] != "#VRML_SIM" || version.empty() || version.size() > 100 || !consists_of(version, "_.-"))
        return refused(Refused::no_version);
    bool const old = version.starts_with('R') && (version.substr(1, 4) < "2023" || version == "R2023a");
    return concat(repository, ":", version, old ? "-ubuntu20.04" : "-ubuntu22.04");
}

bool can_name_extern_robots(std::string_view world_header)
{
    auto const words = split(world_header, ' ');
    auto const version = words.size() < 2 ? std::string_view() : trim(words[1]);
    bool const is_older = version.starts_with('R') && (version.substr(1, 4) < "2022" || version == "R2022a");
    return !is_older;
}

Failure missing_image(std::string_view image)
{
    auto const tag = image.substr(image.rfind(':') + 1);
    return refused(Refused::no_such_image, {{"version", tag.substr(0, tag.rfind('-'))}});
}

std::string compose_template_file(ComposeTemplate kind)
{
    auto const name = kind == ComposeTemplate::theia         ? "theia"
                      : kind == ComposeTemplate::competition ? "competition"
                                                             : "default";
    return concat("docker-compose-", name, ".yml");
}

result<WebotsYml> parse_webots_yml(std::string_view text)
{
    WebotsYml yml;
    for (auto const line : split(text, '\n')) {
        if (line.starts_with("dockerCompose:")) {
            if (auto const read = read_docker_compose(line, yml); !read)
                return read.error();
        } else if (trim(line).starts_with("type:")) {
            yml.messages.push_back(type_message(line));
        }
    }
    return yml;
}

std::string with_extern_participant(std::string_view world)
{
    constexpr std::string_view before = "controller \"participant\"";
    constexpr std::string_view after = "controller \"<extern>\"";
    std::string text;
    for (auto found = world.find(before); found != std::string_view::npos; found = world.find(before)) {
        text.append(world.substr(0, found)).append(after);
        world.remove_prefix(found + before.size());
    }
    return text.append(world);
}

std::string with_last_step(std::string_view dockerfile, std::string_view server)
{
    return concat(dockerfile, "\nLABEL ", server_label, "=", server, "\n");
}

std::string compose_project(std::string_view identity, std::string_view label, std::string_view token)
{
    return concat(identity, "-", label, "-", token);
}

result<std::string> env_file(DockerEnvironment const& environment)
{
    if (!is_harmless_world_name(environment.world))
        return refused(Refused::bad_world_name, {{"file", printable(environment.world, 100)}});
    for (auto const& value : {environment.image, environment.project, environment.server, environment.display,
                              environment.runtime, environment.graphics_device, environment.port_prefix})
        if (!is_harmless_name(value))
            return refused(Refused::bad_docker_setting, {{"value", printable(value, 100)}});
    auto text = concat("IMAGE=", environment.image, "\nPROJECT_PATH=", project_in_container,
                       "\nMAKE=", environment.make ? "1" : "0", "\nPORT=", std::to_string(environment.port),
                       "\nCOMPOSE_PROJECT_NAME=", environment.project, "\nWEBOTS=\"",
                       webots_in_container_command(environment), "\"\nDISPLAY=", environment.display,
                       "\nSERVER=", environment.server, "\nRUNTIME=", environment.runtime,
                       "\nGRAPHICS_DEVICE=", environment.graphics_device,
                       "\nPORT_PREFIX=", environment.port_prefix, "\n");
    if (environment.yml.kind != ComposeTemplate::standard)
        text += concat("THEIA_VOLUME=", environment.yml.volume,
                       "\nTHEIA_PORT=", std::to_string(environment.port + 500), "\n");
    return text;
}

bool is_set_for_compose(std::string_view name)
{
    constexpr auto names = std::to_array<std::string_view>(
        {"DISPLAY", "DOCKER_BUILDKIT", "GRAPHICS_DEVICE", "IMAGE", "MAKE", "PORT", "PORT_PREFIX",
         "PROJECT_PATH", "PYTHONUNBUFFERED", "RUNTIME", "SERVER", "THEIA_PORT", "THEIA_VOLUME", "WEBOTS"});
    return name.starts_with("COMPOSE_") || std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<std::pair<std::string, std::string>>
docker_environment(std::vector<std::pair<std::string, std::string>> const& ours,
                   std::vector<std::string> const& entries)
{
    std::vector<std::pair<std::string, std::string>> environment;
    std::copy_if(ours.begin(), ours.end(), std::back_inserter(environment), [](auto const& variable) {
        auto const& name = variable.first;
        return std::find(passed_on.begin(), passed_on.end(), name) != passed_on.end() ||
               name.starts_with("LC_") || (name.starts_with("DOCKER_") && name != "DOCKER_BUILDKIT");
    });
    for (auto const& [name, value] : named_environment(ours, entries))
        if (!is_set_for_compose(name))
            set_variable(environment, name, value);
    environment.emplace_back("DOCKER_BUILDKIT",
                             "0"); // the other builder does not print the steps that browsers show
    environment.emplace_back("PYTHONUNBUFFERED", "1"); // for compose 1, or its words arrive late
    return environment;
}

std::vector<std::string> compose_up(std::vector<std::string> compose, std::filesystem::path const& file)
{
    return compose_command(std::move(compose), file, {"up", "--build", "--no-color"});
}

std::vector<std::string> compose_down(std::vector<std::string> compose, std::filesystem::path const& file)
{
    return compose_command(std::move(compose), file, {"down", "-v", "--timeout", "0"});
}

std::vector<std::string> compose_restart_controller(std::vector<std::string> compose,
                                                    std::filesystem::path const& file)
{
    return compose_command(std::move(compose), file, {"restart", "--timeout", "0", "controller"});
}

std::vector<std::string> list_containers(std::string_view project)
{
    return {"ps",       "--no-trunc",
            "--filter", concat("label=", project_label, "=", project),
            "--format", concat("{{.ID}}\t{{.Label \"", service_label, "\"}}")};
}

std::vector<std::string> containers_with_project(std::string_view listing)
{
    std::vector<std::string> containers;
    for (auto const line : split(listing, '\n')) {
        auto const fields = split(line, '\t');
        if (fields.size() == 2 && (fields[1] == "webots" || fields[1] == "controller"))
            containers.emplace_back(fields[0]);
    }
    return containers;
}

std::vector<std::string> copy_into_container(std::string_view container, std::filesystem::path const& file,
                                             std::filesystem::path const& name)
{
    return {"cp", file.string(), concat(container, ":", project_in_container, "/", name.generic_string())};
}

} // namespace webots_cloud::core
