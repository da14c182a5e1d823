#include "unit_test.hpp"

#include "adapters/network/acceptor.hpp"
#include "adapters/network/watch_reserve.hpp"

#include <boost/asio/io_context.hpp>

#include <array>
#include <cerrno>
#include <cstddef>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <malloc.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <thread>

using namespace webots_cloud::adapters;

BOOST_AUTO_TEST_SUITE(watch_reserve)

namespace {

/// From now on this thread gets no watches, as where other programs of the user have all. False: the kernel
/// has no filters of system calls.
bool refuse_watches()
{
    std::array<sock_filter, 6> lines{{
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_epoll_ctl, 0, 3),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[1])),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, EPOLL_CTL_ADD, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSPC),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    }};
    sock_fprog const filter{lines.size(), lines.data()};
    return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

} // namespace

BOOST_AUTO_TEST_CASE(one_that_is_let_go_of_is_taken_back_when_it_is_free)
{
    WatchReserve reserve;
    reserve.fill();
    BOOST_TEST(!reserve.is_short());
    BOOST_TEST(reserve.find_free());
    BOOST_TEST(reserve.is_short());
    BOOST_TEST(reserve.find_free()); // of those that nobody has
    reserve.refill();
    BOOST_TEST(!reserve.is_short());
}

BOOST_AUTO_TEST_CASE(a_server_without_a_reserve_has_none_to_let_go_of)
{
    WatchReserve reserve;
    BOOST_TEST(!reserve.is_short());
    BOOST_TEST(!reserve.find_free());
    reserve.refill();
    BOOST_TEST(!reserve.is_short());
}

BOOST_AUTO_TEST_CASE(after_a_failure_it_is_looked_for_a_watch_before_one_is_needed)
{
    WatchReserve reserve;
    BOOST_TEST(reserve.may_watch());
    reserve.has_failed();
    BOOST_TEST(reserve.may_watch()); // there are watches again
    bool may_watch = true;
    bool is_refused = false;
    std::thread([&] {
        is_refused = refuse_watches();
        may_watch = reserve.may_watch();
    }).join();
    if (is_refused)
        BOOST_TEST(!may_watch);
    BOOST_TEST(reserve.may_watch());
}

// Asio keeps memory for each socket that it could not watch.
BOOST_AUTO_TEST_CASE(connections_that_can_not_be_watched_cost_no_memory)
{
    namespace asio = boost::asio;
    constexpr int count = 500;
    int refused = 0;
    std::size_t kept = 0;
    bool is_refused = false;
    std::thread([&] {
        asio::io_context context;
        Acceptor acceptor(context.get_executor());
        BOOST_TEST_REQUIRE(bool(acceptor.listen("127.0.0.1", 0)));
        asio::ip::tcp::endpoint const where(asio::ip::address_v4::loopback(), acceptor.port());
        if (!(is_refused = refuse_watches()))
            return;
        auto const take_one = [&] {
            int const client = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
            bool const is_there = ::connect(client, where.data(), static_cast<socklen_t>(where.size())) == 0;
            asio::ip::tcp::socket socket(context);
            auto const error = acceptor.take(socket);
            refused += is_there && error == boost::system::errc::no_space_on_device ? 1 : 0;
            ::close(client);
        };
        take_one();
        auto const before = ::mallinfo2().uordblks;
        for (int i = 1; i < count; ++i)
            take_one();
        kept = ::mallinfo2().uordblks - before;
    }).join();
    if (!is_refused)
        return;
    BOOST_TEST(refused == count);
    BOOST_TEST(kept < 10'000u); // 87,824, of Asio
}

BOOST_AUTO_TEST_SUITE_END()
