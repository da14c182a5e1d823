#include "docker_engine.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::optional<std::string> parse_container_runtime(std::string_view info)
{
    bool const answered =
        info.find("Docker ") != std::string_view::npos && info.find("Docker  has") == std::string_view::npos;
    if (!answered)
        return std::nullopt;
    return concat(" ", info).find(" nvidia ") != std::string::npos ? "nvidia" : "runc";
}

bool confines_builds(std::string_view info)
{
    constexpr std::string_view list = "name=seccomp,profile=";
    for (auto const line : split(info, '\n'))
        for (auto const word : split(line, ' ')) {
            if (word.starts_with("name=userns") || word.starts_with("name=rootless"))
                return true;
            auto const profile = word.starts_with(list) ? word.substr(list.size()) : std::string_view();
            if (!profile.empty() && profile != "default" && profile != "builtin" && profile != "unconfined")
                return true;
        }
    return false;
}

} // namespace webots_cloud::core
