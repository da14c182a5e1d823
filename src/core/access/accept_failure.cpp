#include "accept_failure.hpp"

#include "core/text.hpp"

#include <cerrno>
#include <system_error>

namespace webots_cloud::core {
namespace {

std::string_view remedy(int error)
{
    switch (error) {
    case EMFILE:
        return "This server has as many files open as it may: raise its limit (LimitNOFILE= of its unit, or "
               "ulimit -n).";
    case ENFILE:
        return "All programs of this machine together have as many files open as they may: raise "
               "fs.file-max.";
    case ENOSPC:
        return "Programs of this server's user have taken all epoll watches that the kernel gives a user: "
               "give "
               "simulations users of their own (docs/sandboxes.md, \"Another user\"), end the one that takes "
               "them (/monitor), or raise fs.epoll.max_user_watches.";
    case ENOMEM:
    case ENOBUFS:
        return "The kernel has no memory left for connections: see what takes it, or lower "
               "\"maxConnections\".";
    default:
        return {};
    }
}

} // namespace

std::string describe_accept_failure(std::string_view what, int error)
{
    auto const reason = std::error_code(error, std::generic_category()).message();
    auto const advice = remedy(error);
    return concat("Can't accept ", what, ": ", reason, ".", advice.empty() ? "" : " ", advice);
}

} // namespace webots_cloud::core
