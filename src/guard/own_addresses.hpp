// Keeps programs that reach the public internet from the addresses of this machine, also from those that it
// gets later.
#pragma once

#include <sys/types.h>

#include <cstddef>

namespace webots_cloud::guard {

/// A socket of netlink hears in the network of the machine, wherever it was taken to, what addresses that
/// has; for each of them a route in the program's network says that it can't be reached. An address that the
/// machine has lost stays out of reach.
class OwnAddresses
{
public:
    OwnAddresses() = default;
    OwnAddresses(OwnAddresses const&) = delete;
    OwnAddresses& operator=(OwnAddresses const&) = delete;
    ~OwnAddresses();

    /// In the network of the machine: hears of its addresses from now on.   False: `errno` says why not.
    bool listen();

    /// In the network of the program, after `listen`: none of the addresses can be reached when it returns.
    /// False: that is not possible.
    bool forbid_all();

    /// Forbids those that come from now on. Returns when it can't, or when `process` (-1: none) has ended.
    void follow(pid_t process);

private:
    bool ask_for_all();
    bool take(bool& is_last);
    bool forbid(void const* address);

    int heard_ = -1;
    int routes_ = -1;
};

} // namespace webots_cloud::guard
