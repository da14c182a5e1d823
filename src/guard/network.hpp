// A network of its own for a program: its own loopback alone, or that and the public internet.
#pragma once

#include "own_addresses.hpp"

#include <sys/types.h>
#include <unistd.h>

#include <utility>

namespace webots_cloud::guard {

/// What a program may reach, and how it is reached.
struct Network
{
    enum class Reach
    {
        host,     ///< Everything: it shares the network of the machine.
        none,     ///< Nothing.
        internet, ///< What `slirp` passes on and `rules` do not forbid.
    };

    Reach reach = Reach::host;
    /// Connections to this port of the machine reach the same port of the program.
    int port = 0;
    /// Instead of the machine's port: a Unix socket, to be made, that hands out sockets connected to the
    /// program's. Null: there is none.
    char const* broker = nullptr;
    char const* slirp = nullptr; ///< `slirp4netns`, absolute.
    char const* ip = nullptr;    ///< `ip` of iproute2, absolute.
    char const* rules = nullptr; ///< A file of lines for `ip -batch`, applied in the new network.

    bool is_own() const { return reach != Reach::host; }
};

/// What can fail when it is made.
enum class NetworkFailure : char
{
    nothing,
    loopback,  ///< It can't be brought up.
    slirp,     ///< slirp4netns can't be started, or did not get ready.
    rules,     ///< `ip` refused them.
    addresses, ///< Those of the machine can't be followed.
    relay,     ///< There can be no process for it.
};

/// A sentence for the operator, without a full stop.
char const* describe(NetworkFailure failure);

/// Waits for a child, -1 for one that could not be made. Whether it exited with 0.
bool ends_well(pid_t child);

/// Carries the lines of the file `rules` out in the network that we are in, as `ip -batch` does.
bool apply_rules(char const* ip, char const* rules);

/// The socket on which the program is reached from outside, bound.   -1: `errno` says why not.
int bind_for(Network const& network);

/// In the network of the program, on a socket of `bind_for` (-1: there is none): `relay` or `hand_out`, with
/// `report`. Where the program reaches the internet it also follows `own`, the addresses of the machine, and
/// exits when it can't.
[[noreturn]] void serve(int acceptor, Network const& network, OwnAddresses& own, int report);

/// Starts slirp4netns, which passes on what the processes of the network of `inside` send as connections of
/// its own. It is our child, and ends with us. Returns when it works.
bool attach_slirp(Network const& network, pid_t inside);

/// Both sides of the making of a network: the guard, outside, and the first process of the namespaces,
/// inside.
class NetworkSetup
{
public:
    explicit NetworkSetup(Network const& network) : network_(network) {}
    NetworkSetup(NetworkSetup const&) = delete;
    ~NetworkSetup(); ///< Also where nothing came of it: the next attempt binds the same port.

    /// Before the namespaces are made.   False: `errno` says why not.
    bool prepare();

    /// Inside, in the new network: returns when it is complete. Starts the relay, our child.
    /// What failed, or `nothing`; then the program must not run.
    NetworkFailure complete_inside();

    /// Inside, after that: the process through which the program is reached; -1: there is none.
    pid_t relay() const { return relay_; }

    /// Outside: does its part for the process that calls `complete_inside`, which says what failed.
    void complete_outside(pid_t inside);

    /// Outside, after that: a pipe in which a byte comes when the program is reached, and nothing else;
    /// the caller's. -1: there is no relay.
    int take_report() { return std::exchange(report_[0], -1); }

private:
    Network const& network_;
    OwnAddresses own_;
    int acceptor_ = -1;
    pid_t relay_ = -1;
    int ends_[2] = {-1, -1};   ///< Outside, inside: a byte each says that its side is ready.
    int report_[2] = {-1, -1}; ///< Of the relay: the end to read from, outside, and its own.
};

} // namespace webots_cloud::guard
