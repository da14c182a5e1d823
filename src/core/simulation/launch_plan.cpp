#include "launch_plan.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

bool is_known_mode(std::string_view mode) noexcept
{
    return mode.empty() || mode == "x3d" || mode == "w3d" || mode == "mjpeg";
}

std::vector<std::string> webots_command(std::filesystem::path const& webots, std::string_view mode,
                                        std::uint16_t port, std::filesystem::path const& world,
                                        bool names_extern_robots)
{
    std::vector<std::string> argv{webots.string(), "--batch", "--mode=pause"};
    if (!is_video(mode)) { // the browser draws
        argv.emplace_back("--minimize");
        argv.emplace_back("--no-rendering");
    }
    argv.push_back(concat("--port=", std::to_string(port)));
    argv.emplace_back("--heartbeat=5000");
    if (names_extern_robots)
        argv.emplace_back("--extern-urls");
    argv.emplace_back(is_video(mode) ? "--stream=mjpeg" : "--stream");
    argv.push_back(world.string());
    return argv;
}

std::vector<std::string> old_webots_command(std::filesystem::path const& webots, OldStream const& stream,
                                            std::uint16_t port, std::filesystem::path const& world)
{
    auto const named = [](std::string_view name, std::string const& value) {
        return value.empty() ? std::string() : concat(";", name, "=", value);
    };
    auto const options = concat(
        "--stream=\"port=", std::to_string(port), ";monitorActivity", stream.picture ? ";mode=mjpeg" : "",
        stream.controller_edit ? ";controllerEdit" : "", named("multimediaServer", stream.multimedia_server),
        named("multimediaStream", stream.multimedia_stream), stream.ssl ? ";ssl" : "", "\"");
    std::vector<std::string> argv{webots.string(), "--batch", "--mode=pause"};
    if (!stream.picture)
        argv.insert(argv.end(), {"--minimize", "--no-rendering"});
    argv.insert(argv.end(), {options, world.string()});
    return argv;
}

} // namespace webots_cloud::core
