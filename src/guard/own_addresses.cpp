// Tells the program's network, by netlink alone, that addresses of this machine can't be reached, and goes on
// listening: a machine gets new ones at any time.
#include "own_addresses.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace webots_cloud::guard {
namespace {

constexpr std::size_t buffer_size = 32 * 1024; // the kernel's messages are no longer

int open_netlink(std::uint32_t groups)
{
    int const made = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    sockaddr_nl ours{};
    ours.nl_family = AF_NETLINK;
    ours.nl_groups = groups;
    if (made < 0 || bind(made, reinterpret_cast<sockaddr*>(&ours), sizeof ours) == 0)
        return made;
    int const error = errno;
    close(made);
    errno = error;
    return -1;
}

/// Whole messages of the kernel's; those of others are none.   -1: `errno` says why.
ssize_t receive(int from, char* buffer)
{
    sockaddr_nl sender{};
    socklen_t size = sizeof sender;
    ssize_t received = -1;
    while ((received = recvfrom(from, buffer, buffer_size, 0, reinterpret_cast<sockaddr*>(&sender), &size)) <
               0 &&
           errno == EINTR)
        continue;
    return received > 0 && sender.nl_pid != 0 ? 0 : received;
}

/// What follows its head.
template<typename Body>
Body* body_of(nlmsghdr* message)
{
    return reinterpret_cast<Body*>(reinterpret_cast<char*>(message) + NLMSG_HDRLEN);
}

/// Of an address that has come: the machine's own; null: there is none.
void const* own_address(nlmsghdr* message)
{
    auto* const about = body_of<ifaddrmsg>(message);
    if (message->nlmsg_type != RTM_NEWADDR || message->nlmsg_len < NLMSG_LENGTH(sizeof *about) ||
        about->ifa_family != AF_INET)
        return nullptr;
    int left = static_cast<int>(IFA_PAYLOAD(message));
    for (auto* each = IFA_RTA(about); RTA_OK(each, left); each = RTA_NEXT(each, left))
        if (each->rta_type == IFA_LOCAL && RTA_PAYLOAD(each) == 4)
            return RTA_DATA(each);
    return nullptr;
}

} // namespace

OwnAddresses::~OwnAddresses()
{
    close(heard_);
    close(routes_);
}

bool OwnAddresses::listen()
{
    heard_ = open_netlink(RTMGRP_IPV4_IFADDR);
    return heard_ >= 0;
}

bool OwnAddresses::forbid_all()
{
    routes_ = open_netlink(0);
    bool is_last = false;
    bool works = routes_ >= 0 && ask_for_all();
    while (works && !is_last)
        works = take(is_last);
    return works;
}

void OwnAddresses::follow(pid_t process)
{
    int const ended = process > 0 ? static_cast<int>(syscall(SYS_pidfd_open, process, 0)) : -1;
    if (process > 0 && ended < 0)
        return;
    for (bool works = true, is_last = false; works;) {
        pollfd watched[] = {{heard_, POLLIN, 0}, {ended, POLLIN, 0}};
        if (poll(watched, 2, -1) < 0)
            continue;
        if (watched[1].revents != 0)
            return;
        works = take(is_last);
    }
}

bool OwnAddresses::ask_for_all()
{
    struct
    {
        nlmsghdr head;
        ifaddrmsg body;
    } request{};
    request.head.nlmsg_len = sizeof request;
    request.head.nlmsg_type = RTM_GETADDR;
    request.head.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
    request.body.ifa_family = AF_INET;
    return send(heard_, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request);
}

/// What has been heard. `is_last`: it was the end of an answer to `ask_for_all`.
bool OwnAddresses::take(bool& is_last)
{
    alignas(nlmsghdr) char buffer[buffer_size];
    auto const size = receive(heard_, buffer);
    if (size < 0)
        return errno == ENOBUFS && ask_for_all(); // some was lost: more came at once than we could hear
    auto left = static_cast<std::uint32_t>(size);
    for (auto* message = reinterpret_cast<nlmsghdr*>(buffer); NLMSG_OK(message, left);
         message = NLMSG_NEXT(message, left)) {
        is_last = message->nlmsg_type == NLMSG_DONE;
        if (message->nlmsg_type == NLMSG_ERROR)
            return false;
        if (auto const* const address = own_address(message); address && !forbid(address))
            return false;
    }
    return true;
}

/// As `ip route replace unreachable ADDRESS/32`.
bool OwnAddresses::forbid(void const* address)
{
    struct
    {
        nlmsghdr head;
        rtmsg body;
        rtattr attribute;
        std::uint8_t destination[4];
    } request{};
    request.head.nlmsg_len = sizeof request;
    request.head.nlmsg_type = RTM_NEWROUTE;
    request.head.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK | NLM_F_CREATE | NLM_F_REPLACE;
    request.body.rtm_family = AF_INET;
    request.body.rtm_dst_len = 32;
    request.body.rtm_table = RT_TABLE_MAIN;
    request.body.rtm_protocol = RTPROT_STATIC;
    request.body.rtm_scope = RT_SCOPE_UNIVERSE;
    request.body.rtm_type = RTN_UNREACHABLE;
    request.attribute.rta_type = RTA_DST;
    request.attribute.rta_len = RTA_LENGTH(sizeof request.destination);
    std::memcpy(request.destination, address, sizeof request.destination);
    if (send(routes_, &request, sizeof request, 0) != static_cast<ssize_t>(sizeof request))
        return false;
    // The kernel acknowledges with an "error" of number 0.
    alignas(nlmsghdr) char buffer[buffer_size];
    auto const size = receive(routes_, buffer);
    auto* const answer = reinterpret_cast<nlmsghdr*>(buffer);
    return size >= static_cast<ssize_t>(NLMSG_LENGTH(sizeof(nlmsgerr))) &&
           answer->nlmsg_type == NLMSG_ERROR && body_of<nlmsgerr>(answer)->error == 0;
}

} // namespace webots_cloud::guard
