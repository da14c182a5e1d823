#include "descriptor.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <csignal>
#include <cstring>

namespace webots_cloud::guard {

bool send_descriptor(int socket, int descriptor, int flags)
{
    char byte = 0;
    iovec data{&byte, 1};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof descriptor)] = {};
    msghdr message{};
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof descriptor);
    std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
    return sendmsg(socket, &message, MSG_NOSIGNAL | flags) == 1;
}

void await_word_of(pid_t child, int descriptor)
{
    constexpr int wake_interval_ms = 250;
    pollfd waiting{descriptor, POLLIN, 0};
    while (poll(&waiting, 1, wake_interval_ms) <= 0)
        kill(child, SIGCONT);
}

} // namespace webots_cloud::guard
