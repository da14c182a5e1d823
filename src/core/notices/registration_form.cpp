#include "registration_form.hpp"

#include "core/text.hpp"
#include "core/web_form.hpp"

#include <cmath>

namespace webots_cloud::core {

std::string registration_form(std::string_view url, double share_idle_time,
                              std::vector<std::string> const& allowed)
{
    std::string repositories;
    for (auto const& repository : allowed)
        repositories.append(repositories.empty() ? "" : ",").append(repository);
    bool const whole = share_idle_time == std::floor(share_idle_time);
    auto const share =
        whole ? std::to_string(static_cast<long>(share_idle_time)) : python_float(share_idle_time);
    return web_form({{"url", url}, {"shareIdleTime", share}, {"allowedRepositories", repositories}});
}

} // namespace webots_cloud::core
