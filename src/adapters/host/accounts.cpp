#include "accounts.hpp"

#include <grp.h>
#include <pwd.h>

#include <algorithm>
#include <array>
#include <iterator>

namespace webots_cloud::adapters {

std::optional<Account> find_account(std::string const& name)
{
    constexpr int max_groups = 64;
    std::array<char, 16 * 1024> text;
    passwd entry{};
    passwd* found = nullptr;
    if (::getpwnam_r(name.c_str(), &entry, text.data(), text.size(), &found) != 0 || !found)
        return std::nullopt;
    Account account;
    account.user = found->pw_uid;
    account.group = found->pw_gid;
    std::array<gid_t, max_groups> groups{};
    int count = max_groups;
    (void)::getgrouplist(name.c_str(), found->pw_gid, groups.data(), &count);
    auto const end = groups.begin() + std::clamp(count, 0, max_groups);
    std::copy_if(groups.begin(), end, std::back_inserter(account.groups),
                 [&](gid_t group) { return group != account.group && group != 0; });
    return account;
}

std::string find_user_name(std::uint32_t user)
{
    std::array<char, 16 * 1024> text;
    passwd entry{};
    passwd* found = nullptr;
    if (::getpwuid_r(user, &entry, text.data(), text.size(), &found) != 0 || !found)
        return {};
    return found->pw_name;
}

} // namespace webots_cloud::adapters
