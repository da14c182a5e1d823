#include "unit_test.hpp"

#include "core/access/accept_failure.hpp"

#include <cerrno>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(accept_failure)

BOOST_AUTO_TEST_CASE(what_is_used_up_is_told_with_what_to_do)
{
    auto const said = [](int error) { return describe_accept_failure("a connection", error); };
    BOOST_TEST(
        said(EMFILE) ==
        "Can't accept a connection: Too many open files. This server has as many files open as it may: "
        "raise its limit (LimitNOFILE= of its unit, or ulimit -n).");
    BOOST_TEST(said(ENFILE).ends_with("raise fs.file-max."));
    BOOST_TEST(
        said(ENOSPC).starts_with("Can't accept a connection: No space left on device. Programs of this "
                                 "server's user have taken all epoll watches"));
    BOOST_TEST(said(ENOSPC).ends_with("raise fs.epoll.max_user_watches."));
    for (int const error : {ENOMEM, ENOBUFS})
        BOOST_TEST(said(error).find("The kernel has no memory left") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_nobody_has_advice_for_is_told_as_it_is)
{
    BOOST_TEST(describe_accept_failure("a connection to the operator's socket", EPROTO) ==
               "Can't accept a connection to the operator's socket: Protocol error.");
}

BOOST_AUTO_TEST_SUITE_END()
