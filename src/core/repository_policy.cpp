#include "repository_policy.hpp"

#include "text.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

bool any_covers(std::vector<std::string> const& prefixes, std::string_view url, std::string_view forge)
{
    return std::any_of(prefixes.begin(), prefixes.end(),
                       [&](std::string const& prefix) { return covers(prefix, url, forge); });
}

} // namespace

bool covers(std::string_view prefix, std::string_view url, std::string_view forge)
{
    std::string decoded_prefix;
    std::string decoded_url;
    if (!percent_decode(prefix, decoded_prefix))
        return false;
    if (!percent_decode(without_query(url), decoded_url))
        decoded_url = without_query(url); // whose fault is told by the grammar, which refuses it
    while (decoded_prefix.ends_with('/'))
        decoded_prefix.pop_back();
    auto const wanted = split(decoded_prefix, '/');
    auto const found = split(decoded_url, '/');
    if (decoded_prefix.empty() || wanted.size() > found.size())
        return false;
    // <forge> / owner / repository / blob|tree / ref ...
    auto const kind = split(forge, '/').size() + 2;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        bool const same = i < kind ? equal_ignoring_case(wanted[i], found[i]) : wanted[i] == found[i];
        bool const both_kinds = i == kind && (wanted[i] == "blob" || wanted[i] == "tree") &&
                                (found[i] == "blob" || found[i] == "tree");
        if (!same && !both_kinds)
            return false;
    }
    return true;
}

std::optional<std::string> refusal(RepositoryPolicy const& policy, std::string_view url,
                                   std::string_view forge, double load)
{
    if (any_covers(policy.allowed, url, forge))
        return std::nullopt;
    if (!policy.docker)
        return "Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\".";
    if (policy.share_idle_time == 0)
        return "This simulation server is not configured to share idle time.";
    if (load > policy.share_idle_time)
        return concat("Cannot share idle time when current load is above threshold: ", python_float(load), ".");
    if (any_covers(policy.blocked, url, forge))
        return concat("Cannot run simulation from blocked repository: ", url);
    return std::nullopt;
}

} // namespace webots_cloud::core
