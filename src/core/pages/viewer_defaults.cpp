#include "viewer_defaults.hpp"

namespace webots_cloud::core {

boost::json::object viewer_defaults(SessionServiceConfig const& config)
{
    boost::json::object defaults;
    if (!config.viewer_url.empty())
        defaults["url"] = config.viewer_url;
    if (config.pause_hidden > Duration::zero())
        defaults["pauseHidden"] = std::chrono::duration<double>(config.pause_hidden).count();
    if (config.relay && config.waiting_room > 0)
        defaults["waiting"] = true;
    return defaults;
}

} // namespace webots_cloud::core
