#include "registration_form.hpp"

#include "text.hpp"

#include <boost/url/encode.hpp>
#include <boost/url/rfc/unreserved_chars.hpp>

#include <cmath>

namespace webots_cloud::core {
namespace {

std::string encoded(std::string_view text) { return boost::urls::encode(text, boost::urls::unreserved_chars); }

} // namespace

std::string registration_form(std::string_view url, double share_idle_time, std::vector<std::string> const& allowed)
{
    std::string repositories;
    for (auto const& repository : allowed)
        repositories.append(repositories.empty() ? "" : ",").append(repository);
    bool const whole = share_idle_time == std::floor(share_idle_time);
    auto const share = whole ? std::to_string(static_cast<long>(share_idle_time)) : python_float(share_idle_time);
    return concat("url=", encoded(url), "&shareIdleTime=", encoded(share), "&allowedRepositories=", encoded(repositories));
}

} // namespace webots_cloud::core
