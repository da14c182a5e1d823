// Asks the kernel for sockets that listen (sock_diag), and only where there is one, whose it is. The other
// way round, through all open files, would take seconds when a simulation opens many.
#include "listening_ports.hpp"

#include "process_tree.hpp"

#include <dirent.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::adapters {
namespace {

// The value of TCP_LISTEN; <netinet/tcp.h> and <linux/tcp.h> do not go together.
constexpr unsigned listen_state = 10;

struct Listening
{
    std::uint16_t port = 0;
    uid_t user = 0;
};

using PortsByInode = std::unordered_map<std::uint32_t, Listening>;

// Of one look: see the header.
constexpr std::size_t max_processes = 64;
constexpr std::size_t max_files = 8192;

/// A question for sockets that listen, with a condition on their port: a program for the kernel, whose
/// instructions have the size of a word, an argument in the word after them, and say how far to go on when
/// they hold and when not. One that leads behind the end refuses the socket.
struct Request
{
    nlmsghdr header;
    inet_diag_req_v2 body;
    nlattr attribute;
    std::array<inet_diag_bc_op, 4> condition;
};

/// Reads one answer; false when it was the last.
bool take_answer(char* data, ssize_t size, PortsByInode& ports)
{
    auto left = static_cast<unsigned>(size);
    for (auto* header = reinterpret_cast<nlmsghdr*>(data); NLMSG_OK(header, left);
         header = NLMSG_NEXT(header, left)) {
        if (header->nlmsg_type == NLMSG_DONE || header->nlmsg_type == NLMSG_ERROR)
            return false;
        auto const* socket =
            reinterpret_cast<inet_diag_msg const*>(reinterpret_cast<char const*>(header) + NLMSG_HDRLEN);
        Listening found;
        found.port = ntohs(socket->id.idiag_sport);
        found.user = socket->idiag_uid;
        ports.emplace(socket->idiag_inode, found);
    }
    return true;
}

std::array<inet_diag_bc_op, 4> port_between(std::uint16_t first, std::uint16_t last)
{
    constexpr std::uint8_t word = sizeof(inet_diag_bc_op);
    inet_diag_bc_op at_least{INET_DIAG_BC_S_GE, 2 * word, 5 * word};
    inet_diag_bc_op at_most{INET_DIAG_BC_S_LE, 2 * word, 3 * word};
    return {at_least, inet_diag_bc_op{0, 0, first}, at_most, inet_diag_bc_op{0, 0, last}};
}

/// Adds the TCP sockets of one address family that listen on such ports (sock_diag(7)).
void ask_kernel(int netlink, std::uint8_t family, std::uint16_t first, std::uint16_t last,
                PortsByInode& ports)
{
    Request request{};
    request.attribute.nla_type = INET_DIAG_REQ_BYTECODE;
    request.attribute.nla_len = sizeof request.attribute + sizeof request.condition;
    request.condition = port_between(first, last);
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

PortsByInode listening_sockets(std::uint16_t first, std::uint16_t last)
{
    PortsByInode ports;
    int const netlink = ::socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG);
    if (netlink < 0)
        return ports;
    ask_kernel(netlink, AF_INET, first, last, ports);
    ask_kernel(netlink, AF_INET6, first, last, ports);
    ::close(netlink);
    return ports;
}

/// What is left of the files that may be looked at.
using Budget = std::size_t;

/// The lowest of `sockets` that belongs to the user of a process whose files we may not list: a subordinate
/// user of this server, who is that of one simulation alone. 0: none.
std::uint16_t port_of_user(pid_t process, PortsByInode const& sockets)
{
    struct stat status;
    if (::stat(("/proc/" + std::to_string(process)).c_str(), &status) != 0 || status.st_uid == 0 ||
        status.st_uid == ::geteuid())
        return 0;
    std::uint16_t lowest = 0;
    for (auto const& [inode, socket] : sockets)
        if (socket.user == status.st_uid && (lowest == 0 || socket.port < lowest))
            lowest = socket.port;
    return lowest;
}

/// The lowest of `sockets` that is among the open files of a process; 0: none.
std::uint16_t port_of(pid_t process, PortsByInode const& sockets, Budget& files)
{
    auto const folder = "/proc/" + std::to_string(process) + "/fd";
    std::unique_ptr<DIR, int (*)(DIR*)> const directory(::opendir(folder.c_str()), ::closedir);
    if (!directory)
        return errno == EACCES ? port_of_user(process, sockets) : std::uint16_t{0};
    constexpr std::string_view prefix = "socket:[";
    std::uint16_t lowest = 0;
    for (; files > 0; --files) {
        auto const* entry = ::readdir(directory.get());
        if (!entry)
            break;
        std::array<char, 64> target;
        auto const size = ::readlinkat(::dirfd(directory.get()), entry->d_name, target.data(), target.size());
        if (size <= 0 || !std::string_view(target.data(), static_cast<std::size_t>(size)).starts_with(prefix))
            continue;
        std::uint32_t inode = 0;
        std::from_chars(target.data() + prefix.size(), target.data() + size, inode);
        auto const socket = sockets.find(inode);
        if (socket != sockets.end() && (lowest == 0 || socket->second.port < lowest))
            lowest = socket->second.port;
    }
    return lowest;
}

} // namespace

std::uint16_t listening_port(pid_t root, std::uint16_t first, std::uint16_t last)
{
    auto const sockets = listening_sockets(first, last);
    if (sockets.empty()) // as it is until the simulator is ready
        return 0;
    Budget files = max_files;
    for (auto const process : process_tree(root, max_processes).processes)
        if (auto const port = port_of(process, sockets, files); port != 0)
            return port;
    return 0;
}

bool has_listener(std::uint16_t port)
{
    return !listening_sockets(port, port).empty();
}

bool has_listener(std::string const& unix_socket)
{
    constexpr unsigned accepts = 1U << 16; // __SO_ACCEPTCON
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> const table(std::fopen("/proc/self/net/unix", "re"),
                                                                std::fclose);
    std::array<char, 512> line;
    while (table && std::fgets(line.data(), line.size(), table.get())) {
        unsigned flags = 0;
        int name = 0;
        if (std::sscanf(line.data(), "%*s %*x %*x %x %*x %*x %*u %n", &flags, &name) != 1 || name == 0)
            continue;
        std::string_view found(line.data() + name);
        if (found.ends_with('\n'))
            found.remove_suffix(1);
        if ((flags & accepts) != 0 && found == unix_socket)
            return true;
    }
    return false;
}

} // namespace webots_cloud::adapters
