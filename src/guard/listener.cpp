// A dump of the listening sockets alone, with a condition on their port, which the kernel checks: its table
// of listeners is small, that of connections has hundreds of thousands of entries on large machines.
#include "listener.hpp"

#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

namespace webots_cloud::guard {
namespace {

constexpr unsigned state_listen = 10; // TCP_LISTEN; <netinet/tcp.h> and <linux/tcp.h> do not go together

/// The condition is a program for the kernel: each instruction says how far to go on when it holds and when
/// not, and has its argument in the word after it. Where it leads behind the end, the socket is refused.
struct Request
{
    nlmsghdr header;
    inet_diag_req_v2 body;
    nlattr attribute;
    std::array<inet_diag_bc_op, 4> condition;
};

Request request_for(std::uint8_t family, std::uint16_t port)
{
    constexpr std::uint8_t word = sizeof(inet_diag_bc_op);
    Request request{};
    request.header.nlmsg_len = sizeof request;
    request.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
    request.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
    request.body.sdiag_family = family;
    request.body.sdiag_protocol = IPPROTO_TCP;
    request.body.idiag_states = 1U << state_listen;
    request.attribute.nla_type = INET_DIAG_REQ_BYTECODE;
    request.attribute.nla_len = sizeof request.attribute + sizeof request.condition;
    request.condition = {{{INET_DIAG_BC_S_GE, 2 * word, 5 * word},
                          {0, 0, port},
                          {INET_DIAG_BC_S_LE, 2 * word, 3 * word},
                          {0, 0, port}}};
    return request;
}

} // namespace

int pause_between_looks(long waited_ms)
{
    constexpr long shortest = 1;  // ms
    constexpr long longest = 250; // ms
    return static_cast<int>(std::clamp(waited_ms / 8, shortest, longest));
}

ListenerQuestion::ListenerQuestion(int port)
    : port_(port), kernel_(socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG))
{}

ListenerQuestion::~ListenerQuestion()
{
    close(kernel_);
}

ListenerQuestion::Answer ListenerQuestion::ask()
{
    auto const answer = ask(AF_INET);
    return answer == Answer::no ? ask(AF_INET6) : answer;
}

/// Reads all that the kernel answers, lest it be taken for the next answer.
ListenerQuestion::Answer ListenerQuestion::ask(unsigned char family)
{
    auto const request = request_for(family, static_cast<std::uint16_t>(port_));
    if (send(kernel_, &request, sizeof request, 0) < 0)
        return Answer::unknown;
    auto answer = Answer::no;
    alignas(nlmsghdr) std::array<char, 8 * 1024> buffer;
    for (;;) {
        auto const size = recv(kernel_, buffer.data(), buffer.size(), 0);
        if (size < 0 && errno == EINTR)
            continue;
        if (size <= 0)
            return Answer::unknown;
        auto left = static_cast<unsigned>(size);
        for (auto* header = reinterpret_cast<nlmsghdr*>(buffer.data()); NLMSG_OK(header, left);
             header = NLMSG_NEXT(header, left)) {
            if (header->nlmsg_type == NLMSG_ERROR)
                return Answer::unknown;
            if (header->nlmsg_type == NLMSG_DONE)
                return answer;
            answer = Answer::yes;
        }
    }
}

} // namespace webots_cloud::guard
