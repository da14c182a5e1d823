// Users of this computer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// A user of this computer.
struct Account
{
    Account() = default;

    std::uint32_t user = 0;
    std::uint32_t group = 0;
    std::vector<std::uint32_t> groups; ///< All that the user is in, but `group`.
};

/// Looks a user up by name; nothing where there is none. May block, as for users from a directory service.
std::optional<Account> find_account(std::string const& name);

/// The name of a user; empty: there is none. May block, too.
std::string find_user_name(std::uint32_t user);

} // namespace webots_cloud::adapters
