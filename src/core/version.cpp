#include <webots_cloud/version.hpp>

namespace webots_cloud {

std::string_view version() noexcept
{
    return WEBOTS_CLOUD_VERSION;
}

} // namespace webots_cloud
