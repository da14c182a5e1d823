#include "listening_ports.hpp"

#include <dirent.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::adapters {
namespace {

// The value of TCP_LISTEN; <netinet/tcp.h> and <linux/tcp.h> do not go together.
constexpr unsigned listen_state = 10;

using PortsByInode = std::unordered_map<std::uint32_t, std::uint16_t>;

struct Request
{
    nlmsghdr header;
    inet_diag_req_v2 body;
};

/// Reads one answer; false when it was the last.
bool take_answer(char* data, ssize_t size, PortsByInode& ports)
{
    auto left = static_cast<unsigned>(size);
    for (auto* header = reinterpret_cast<nlmsghdr*>(data); NLMSG_OK(header, left); header = NLMSG_NEXT(header, left)) {
        if (header->nlmsg_type == NLMSG_DONE || header->nlmsg_type == NLMSG_ERROR)
            return false;
        auto const* socket = reinterpret_cast<inet_diag_msg const*>(reinterpret_cast<char const*>(header) + NLMSG_HDRLEN);
        ports.emplace(socket->idiag_inode, ntohs(socket->id.idiag_sport));
    }
    return true;
}

/// Adds every listening TCP socket of one address family (sock_diag(7)).
void ask_kernel(int netlink, std::uint8_t family, PortsByInode& ports)
{
    Request request{};
    request.header.nlmsg_len = sizeof request;
    request.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
    request.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
    request.body.sdiag_family = family;
    request.body.sdiag_protocol = IPPROTO_TCP;
    request.body.idiag_states = 1U << listen_state;
    if (::send(netlink, &request, sizeof request, 0) < 0)
        return;
    alignas(nlmsghdr) std::array<char, 16 * 1024> buffer;
    for (;;) {
        auto const size = ::recv(netlink, buffer.data(), buffer.size(), 0);
        if (size <= 0 || !take_answer(buffer.data(), size, ports))
            return;
    }
}

PortsByInode listening_sockets()
{
    PortsByInode ports;
    int const netlink = ::socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG);
    if (netlink < 0)
        return ports;
    ask_kernel(netlink, AF_INET, ports);
    ask_kernel(netlink, AF_INET6, ports);
    ::close(netlink);
    return ports;
}

std::vector<pid_t> children(pid_t parent)
{
    std::vector<pid_t> found;
    std::ifstream list("/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children");
    for (pid_t child = 0; list >> child;)
        found.push_back(child);
    return found;
}

void add_ports_of(pid_t process, PortsByInode const& sockets, std::vector<std::uint16_t>& ports)
{
    auto const folder = "/proc/" + std::to_string(process) + "/fd";
    std::unique_ptr<DIR, int (*)(DIR*)> const directory(::opendir(folder.c_str()), ::closedir);
    if (!directory)
        return;
    constexpr std::string_view prefix = "socket:[";
    while (auto const* entry = ::readdir(directory.get())) {
        std::array<char, 64> target;
        auto const size = ::readlinkat(::dirfd(directory.get()), entry->d_name, target.data(), target.size());
        if (size <= 0 || !std::string_view(target.data(), static_cast<std::size_t>(size)).starts_with(prefix))
            continue;
        std::uint32_t inode = 0;
        std::from_chars(target.data() + prefix.size(), target.data() + size, inode);
        if (auto const socket = sockets.find(inode); socket != sockets.end())
            ports.push_back(socket->second);
    }
}

} // namespace

std::vector<std::uint16_t> listening_ports(pid_t root)
{
    auto const sockets = listening_sockets();
    std::vector<std::uint16_t> ports;
    std::vector<pid_t> tree{root};
    for (std::size_t i = 0; i < tree.size(); ++i) {
        add_ports_of(tree[i], sockets, ports);
        for (pid_t const child : children(tree[i]))
            tree.push_back(child);
    }
    std::sort(ports.begin(), ports.end());
    ports.erase(std::unique(ports.begin(), ports.end()), ports.end());
    return ports;
}

} // namespace webots_cloud::adapters
