#include "launch_plan.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>

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

bool is_known_mode(std::string_view mode) noexcept
{
    return mode.empty() || mode == "x3d" || mode == "w3d" || mode == "mjpeg";
}

std::vector<std::string> webots_command(std::filesystem::path const& webots, std::string_view mode, std::uint16_t port,
                                        std::filesystem::path const& world)
{
    bool const is_video = mode == "mjpeg";
    std::vector<std::string> argv{webots.string(), "--batch", "--mode=pause"};
    if (!is_video) { // the browser draws
        argv.emplace_back("--minimize");
        argv.emplace_back("--no-rendering");
    }
    argv.push_back(concat("--port=", std::to_string(port)));
    argv.emplace_back("--heartbeat=5000");
    argv.emplace_back(is_video ? "--stream=mjpeg" : "--stream");
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
