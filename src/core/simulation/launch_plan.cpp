#include "launch_plan.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace webots_cloud::core {
namespace {

// Locale and time zone, where things are, the screen, and the graphics and sound drivers' own switches.
constexpr std::array passed_on = {"HOME", "LANG", "LANGUAGE", "LOGNAME", "PATH", "SHELL", "TMPDIR", "TZ", "USER", "XAUTHORITY",
                                  "WAYLAND_DISPLAY", "LD_LIBRARY_PATH"};
constexpr std::array<std::string_view, 9> passed_on_prefixes = {"LC_", "WEBOTS_", "QT_", "XDG_", "LIBGL_", "MESA_", "GALLIUM_",
                                                                 "NVIDIA_", "CUDA_"};

bool is_passed_on(std::string_view name)
{
    return std::find(passed_on.begin(), passed_on.end(), name) != passed_on.end() ||
           std::any_of(passed_on_prefixes.begin(), passed_on_prefixes.end(),
                       [&](std::string_view prefix) { return name.starts_with(prefix); });
}

} // namespace

std::optional<WebotsVersion> parse_world_header(std::string_view first_line)
{
    constexpr std::string_view magic = "#VRML_SIM R";
    if (!first_line.starts_with(magic))
        return std::nullopt;
    first_line.remove_prefix(magic.size());
    WebotsVersion version;
    auto const [end, error] = std::from_chars(first_line.data(), first_line.data() + first_line.size(), version.year);
    if (error != std::errc() || version.year < 2018 || version.year > 2999)
        return std::nullopt;
    if (end != first_line.data() + first_line.size() && *end >= 'a' && *end <= 'z')
        version.letter = *end;
    return version;
}

std::string stream_mode(std::string_view requested, std::optional<WebotsVersion> version)
{
    if (requested != "x3d" && requested != "w3d")
        return std::string(requested);
    constexpr WebotsVersion first_with_w3d{2023, 'b'};
    return version && *version < first_with_w3d ? "x3d" : "w3d";
}

bool is_known_mode(std::string_view mode) noexcept
{
    return mode.empty() || mode == "x3d" || mode == "w3d" || mode == "mjpeg";
}

std::vector<std::string> webots_command(std::filesystem::path const& webots, std::string_view mode, std::uint16_t port,
                                        std::filesystem::path const& world)
{
    std::vector<std::string> argv{webots.string(), "--batch", "--mode=pause"};
    if (mode.empty() || mode == "x3d") {
        argv.emplace_back("--minimize");
        argv.emplace_back("--no-rendering");
    }
    argv.push_back(concat("--port=", std::to_string(port)));
    argv.emplace_back("--heartbeat=5000");
    argv.push_back(mode.empty() ? "--stream" : concat("--stream=", mode));
    argv.push_back(world.string());
    return argv;
}

std::vector<std::string> old_webots_command(std::filesystem::path const& webots, OldStream const& stream, std::uint16_t port,
                                            std::filesystem::path const& world)
{
    auto const named = [](std::string_view name, std::string const& value) {
        return value.empty() ? std::string() : concat(";", name, "=", value);
    };
    auto const options = concat("--stream=\"port=", std::to_string(port), ";monitorActivity",
                                stream.controller_edit ? ";controllerEdit" : "",
                                named("multimediaServer", stream.multimedia_server),
                                named("multimediaStream", stream.multimedia_stream), stream.ssl ? ";ssl" : "", "\"");
    return {webots.string(), "--batch", "--mode=pause", "--minimize", "--no-rendering", options, world.string()};
}

std::vector<std::pair<std::string, std::string>>
webots_environment(std::vector<std::pair<std::string, std::string>> const& ours, std::string_view display)
{
    std::vector<std::pair<std::string, std::string>> environment;
    std::copy_if(ours.begin(), ours.end(), std::back_inserter(environment),
                 [](auto const& variable) { return is_passed_on(variable.first); });
    environment.emplace_back("DISPLAY", display);
    return environment;
}

} // namespace webots_cloud::core
