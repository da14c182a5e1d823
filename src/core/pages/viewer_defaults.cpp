#include "viewer_defaults.hpp"

#include <boost/json/serialize.hpp>

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

std::string viewer_defaults_json(SessionServiceConfig const& config)
{
    return boost::json::serialize(viewer_defaults(config));
}

} // namespace webots_cloud::core
