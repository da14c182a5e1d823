#include "unit_test.hpp"

#include <webots_cloud/transport/tunnel_group.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(tunnel_group)

namespace {

struct RecordedTunnel final : TunnelGroup::Tunnel
{
    explicit RecordedTunnel(TunnelGroup& group) : group(group) {}

    void end() override
    {
        ++ends;
        group.leave(*this);
        if (neighbour)
            group.leave(*neighbour);
    }

    TunnelGroup& group;
    RecordedTunnel* neighbour = nullptr; ///< Leaves at the same time.
    int ends = 0;
};

TimePoint const start = TimePoint(1h);

} // namespace

BOOST_AUTO_TEST_CASE(closing_ends_each_tunnel_once_and_refuses_new_ones)
{
    TunnelGroup group;
    RecordedTunnel first(group);
    RecordedTunnel second(group);
    RecordedTunnel gone(group);
    BOOST_TEST(group.join(first));
    BOOST_TEST(group.join(second));
    BOOST_TEST(group.join(gone));
    BOOST_TEST(group.open() == 3u);
    group.leave(gone);
    BOOST_TEST(!group.is_closed());
    group.close();
    BOOST_TEST(group.is_closed());
    BOOST_TEST(first.ends == 1);
    BOOST_TEST(second.ends == 1);
    BOOST_TEST(gone.ends == 0);
    BOOST_TEST(group.open() == 0u);
    BOOST_TEST(!group.join(gone));
    BOOST_TEST(group.open() == 0u);
}

BOOST_AUTO_TEST_CASE(when_new_ones_are_refused_those_that_are_open_end_by_themselves)
{
    TunnelGroup group;
    RecordedTunnel first(group);
    RecordedTunnel second(group);
    RecordedTunnel late(group);
    BOOST_TEST(group.join(first));
    BOOST_TEST(group.join(second));
    int emptied = 0;
    group.refuse_new([&] { ++emptied; });
    BOOST_TEST(!group.join(late));
    BOOST_TEST(group.is_closed());
    group.leave(first);
    BOOST_TEST(emptied == 0);
    group.leave(second);
    BOOST_TEST(emptied == 1);
    BOOST_TEST(first.ends == 0);
    group.close();
    BOOST_TEST(emptied == 1);
}

BOOST_AUTO_TEST_CASE(a_group_that_is_empty_or_closed_has_nobody_to_wait_for)
{
    TunnelGroup empty;
    int emptied = 0;
    empty.refuse_new([&] { ++emptied; });
    BOOST_TEST(emptied == 1);

    TunnelGroup watched;
    RecordedTunnel tunnel(watched);
    BOOST_TEST(watched.join(tunnel));
    watched.refuse_new([&] { ++emptied; });
    watched.close();
    BOOST_TEST(tunnel.ends == 1);
    BOOST_TEST(emptied == 1);
}

BOOST_AUTO_TEST_CASE(a_tunnel_that_ends_may_take_another_one_with_it)
{
    TunnelGroup group;
    RecordedTunnel first(group);
    RecordedTunnel second(group);
    first.neighbour = &second;
    second.neighbour = &first;
    (void)group.join(first);
    (void)group.join(second);
    group.close();
    BOOST_TEST(first.ends + second.ends == 1);
}

BOOST_AUTO_TEST_CASE(without_a_limit_everything_may_pass_and_is_counted)
{
    TunnelGroup group;
    group.count_received(10);
    group.count_sent(std::uint64_t{1} << 40);
    BOOST_TEST(group.allowance(start) == SIZE_MAX);
    BOOST_TEST(group.received() == 10u);
    BOOST_TEST(group.sent() == std::uint64_t{1} << 40);
}

BOOST_AUTO_TEST_CASE(in_the_long_run_as_much_passes_as_the_limit_says_in_both_directions_together)
{
    TunnelGroup group(1'000'000);
    std::uint64_t passed = 0;
    for (auto now = start; now < start + 10s; now += TunnelGroup::pause) {
        auto const part = group.allowance(now);
        group.count_received(part / 2);
        group.count_sent(part - part / 2);
        passed += part;
        BOOST_TEST(group.allowance(now) == 0u);
    }
    BOOST_TEST(passed >= 10'000'000u);
    BOOST_TEST(passed <= 10'250'000u, "a burst more at most");
}

BOOST_AUTO_TEST_CASE(a_silence_saves_up_no_more_than_a_burst)
{
    TunnelGroup group(1'000'000);
    BOOST_TEST(group.allowance(start) == 250'000u);
    BOOST_TEST(group.allowance(start + 1h) == 250'000u);
}

BOOST_AUTO_TEST_CASE(what_passed_beyond_the_limit_is_made_up_for)
{
    TunnelGroup group(1'000'000);
    (void)group.allowance(start);
    group.count_sent(350'000);
    BOOST_TEST(group.allowance(start + 50ms) == 0u);
    BOOST_TEST(group.allowance(start + 200ms) == 100'000u);
}

BOOST_AUTO_TEST_CASE(who_is_at_the_limit_waits_until_a_portion_may_pass)
{
    TunnelGroup group(100'000);
    group.count_sent(group.allowance(start));
    BOOST_TEST(group.allowance(start + 1ms) == 0u);
    BOOST_TEST(group.allowance(start + 40ms) == 0u);
    BOOST_TEST(group.allowance(start + 50ms) >= 4096u);
}

BOOST_AUTO_TEST_CASE(a_limit_can_change)
{
    TunnelGroup group(100);
    BOOST_TEST(group.allowance(start) == 4096u, "a small limit lets a message through now and then");
    group.set_limit(0);
    group.count_sent(1'000'000);
    BOOST_TEST(group.allowance(start) == SIZE_MAX);
    group.set_limit(1'000'000);
    BOOST_TEST(group.allowance(start) == 250'000u);
}

BOOST_AUTO_TEST_SUITE_END()
