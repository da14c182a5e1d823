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

} // namespace webots_cloud::core
