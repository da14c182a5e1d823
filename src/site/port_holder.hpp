// Who has a port that a server of ours needs, and what to do about it.
#pragma once

#include "servers.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace webots_cloud::site {

/// A socket that listens.
struct Listener
{
    Listener() = default;
    Listener(std::uint64_t inode, uid_t user) : inode(inode), user(user) {}

    bool operator==(Listener const&) const = default;

    std::uint64_t inode = 0;
    uid_t user = 0;
};

/// Those of a port in `/proc/net/tcp` or `tcp6`.
std::vector<Listener> parse_listeners(std::string_view table, std::uint16_t port);

/// A process that may have the port.
struct Suspect
{
    Suspect() = default;

    Process process;
    std::vector<std::uint64_t> sockets; ///< Empty also where we may not look into it.
    /// What it listens on by its configuration, if it is a server of ours.
    std::vector<std::uint16_t> ports;
};

/// The one that has the port, or null: it can't be told. Our servers show their sockets to root alone; for
/// others their configuration and their user have to do.
Suspect const* holder_of(std::uint16_t port, std::vector<Listener> const& listeners,
                         std::vector<Suspect> const& suspects);

/// `PORT is in use by ...`, as far as is known, as the beginning of a sentence, and how to end that.
struct Holder
{
    Holder() = default;

    std::string who = "another program";
    std::string remedy = "End it"; ///< The beginning of a sentence.
};

/// Which site needs a port.
struct PortUse
{
    PortUse() = default;

    Kind kind = Kind::session;
    std::string name;            ///< Of the configurations.
    bool is_redirect = false;    ///< It is `redirectPort`.
    bool has_session = false;    ///< There is a configuration for that kind, too.
    bool has_website = false;    ///< The same.
    std::uint16_t site_port = 0; ///< The one that people know.
};

/// How to give the site another port: in one command, and for good in each file that names it.
std::string other_ports(PortUse const& use);

/// `owner`: the user of the process, if it is not ours; otherwise empty. `has_script`: there is a server.sh
/// in the folder that it was started from.
Holder describe_holder(Process const& process, std::string const& owner, bool has_script);

} // namespace webots_cloud::site
