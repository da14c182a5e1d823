#include "unit_test.hpp"

#include "adapters/names/name_resolver.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
using adapters::Addresses;
using adapters::NameResolver;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(name_resolver)

namespace {

/// Resolves every name at once, except those that begin with "hole": these when `release` is called.
class Names
{
public:
    void operator()(std::string const& name, std::function<void(result<Addresses>)> const& answer)
    {
        ++lookups_;
        auto tell = [name, answer] {
            if (name.ends_with("nobody"))
                answer(Failure(errc::not_found, "nobody knows it"));
            else
                answer(Addresses{asio::ip::make_address("192.0.2.1")});
        };
        if (name.starts_with("hole") && !released_)
            held_.push_back(std::move(tell));
        else
            tell();
    }

    void release()
    {
        released_ = true;
        for (auto const& tell : std::exchange(held_, {}))
            tell();
    }

    int lookups() const { return lookups_; }

private:
    std::vector<std::function<void()>> held_;
    bool released_ = false;
    int lookups_ = 0;
};

adapters::NameResolverParams params_of(std::size_t lookups, Duration slow_after)
{
    adapters::NameResolverParams params;
    params.max_lookups = lookups;
    params.slow_after = slow_after;
    return params;
}

struct Fixture
{
    explicit Fixture(adapters::NameResolverParams params = {})
        : resolver(std::in_place, context.get_executor(), std::ref(names), params)
    {}

    using Outcome = std::shared_ptr<std::optional<result<Addresses>>>;

    /// Starts to resolve a name; the result arrives while the context runs.
    Outcome ask(std::string name, Duration patience = 1h, asio::cancellation_slot slot = {})
    {
        auto const outcome = std::make_shared<std::optional<result<Addresses>>>();
        auto finished = [outcome](std::exception_ptr failure, result<Addresses> addresses) {
            if (!failure)
                *outcome = std::move(addresses);
        };
        asio::co_spawn(context,
                       resolver->resolve(std::move(name), std::chrono::steady_clock::now() + patience),
                       asio::bind_cancellation_slot(slot, finished));
        return outcome;
    }

    void run_until(Outcome const& outcome)
    {
        auto const end = std::chrono::steady_clock::now() + 30s; // a deadline for a broken resolver only
        context.restart();                                       // it stops whenever it is out of work
        while (!*outcome && std::chrono::steady_clock::now() < end)
            context.run_one_for(1s);
        BOOST_TEST_REQUIRE(outcome->has_value());
    }

    asio::io_context context{1};
    Names names;
    std::optional<NameResolver> resolver;
};

} // namespace

BOOST_AUTO_TEST_CASE(a_name_that_hangs_delays_no_other)
{
    Fixture fixture;
    auto const hanging = fixture.ask("hole.example.org");
    for (int i = 0; i < 3; ++i) {
        auto const good = fixture.ask("good.example.org");
        fixture.run_until(good);
        BOOST_TEST((**good)->front().to_string() == "192.0.2.1");
    }
    BOOST_TEST(!hanging->has_value());
    fixture.names.release();
    fixture.run_until(hanging);
    BOOST_TEST((*hanging)->has_value());
}

BOOST_AUTO_TEST_CASE(whoever_asks_for_a_name_that_hangs_waits_until_the_own_deadline)
{
    Fixture fixture;
    auto const hasty = fixture.ask("hole", 0s);
    fixture.run_until(hasty);
    BOOST_TEST(((*hasty)->error() == errc::unreachable));
    BOOST_TEST((*hasty)->error().message() == "the name hole can't be resolved: no answer in time");
}

BOOST_AUTO_TEST_CASE(addresses_are_good_for_a_while_and_no_answer_is_not)
{
    Fixture fixture;
    for (int i = 0; i < 3; ++i) {
        auto const known = fixture.ask("good");
        fixture.run_until(known);
        BOOST_TEST((**known)->front().to_string() == "192.0.2.1");
    }
    BOOST_TEST(fixture.names.lookups() == 1);
    fixture.run_until(fixture.ask("nobody"));
    fixture.run_until(fixture.ask("nobody"));
    BOOST_TEST(fixture.names.lookups() == 3);
}

BOOST_AUTO_TEST_CASE(a_name_is_looked_up_once_for_all_who_ask_meanwhile_and_again_for_later_ones)
{
    adapters::NameResolverParams params;
    params.good_for = 0s;
    Fixture fixture(params);
    auto const first = fixture.ask("hole");
    auto const second = fixture.ask("hole");
    fixture.run_until(fixture.ask("good"));
    fixture.names.release();
    fixture.run_until(first);
    fixture.run_until(second);
    BOOST_TEST(fixture.names.lookups() == 2);
    fixture.run_until(fixture.ask("hole"));
    BOOST_TEST(fixture.names.lookups() == 3);
}

BOOST_AUTO_TEST_CASE(whoever_asks_for_one_name_too_many_is_told_so)
{
    Fixture fixture(params_of(1, 1h));
    auto const hanging = fixture.ask("hole");
    auto const same = fixture.ask("hole");
    auto const refused = fixture.ask("good");
    fixture.run_until(refused);
    BOOST_TEST((*refused)->error().message() ==
               "the name good can't be resolved: too many names are being looked up");
    fixture.names.release();
    fixture.run_until(hanging);
    fixture.run_until(same);
    auto const good = fixture.ask("good");
    fixture.run_until(good);
    BOOST_TEST((*good)->has_value());
}

BOOST_AUTO_TEST_CASE(a_name_that_hung_is_left_alone_for_a_while_and_its_last_addresses_serve)
{
    Fixture fixture(params_of(64, 0s));
    auto const slow = fixture.ask("hole");
    auto const dead = fixture.ask("hole of nobody");
    fixture.context.poll();
    fixture.run_until(
        fixture.ask("hole", 0s)); // its deadline is later than the moment from which names count as slow
    fixture.names.release();
    fixture.run_until(slow);
    fixture.run_until(dead);
    auto const lookups = fixture.names.lookups();
    auto const again = fixture.ask("hole");
    fixture.run_until(again);
    BOOST_TEST((**again)->front().to_string() == "192.0.2.1");
    auto const in_vain = fixture.ask("hole of nobody");
    fixture.run_until(in_vain);
    BOOST_TEST((*in_vain)->error().message() == "the name hole of nobody can't be resolved: no answer the "
                                                "last time; it will be looked up again in a moment");
    BOOST_TEST(fixture.names.lookups() == lookups);
}

BOOST_AUTO_TEST_CASE(what_the_lookup_says_is_the_answer)
{
    Fixture fixture;
    auto const unknown = fixture.ask("nobody");
    fixture.run_until(unknown);
    BOOST_TEST((*unknown)->error().message() == "nobody knows it");
}

BOOST_AUTO_TEST_CASE(who_is_cancelled_waits_no_longer_and_an_answer_may_come_after_its_resolver)
{
    Fixture fixture;
    asio::cancellation_signal cancel;
    auto const hanging = fixture.ask("hole", 1h, cancel.slot());
    fixture.context.poll();
    cancel.emit(asio::cancellation_type::terminal);
    fixture.run_until(hanging);
    BOOST_TEST(((*hanging)->error().code() == asio::error::operation_aborted));
    fixture.resolver.reset();
    fixture.names.release();
}

BOOST_AUTO_TEST_SUITE_END()
