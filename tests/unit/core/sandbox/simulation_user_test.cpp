#include "unit_test.hpp"

#include "core/sandbox/simulation_user.hpp"

#include <set>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(simulation_user)

namespace {

using Kind = SimulationUser::Kind;

constexpr std::uint64_t everything = 0x1FF'FFFF'FFFF;

KnownUser known(std::uint32_t number)
{
    KnownUser user;
    user.name = "ada";
    user.user = number;
    user.group = 7;
    user.groups = {44};
    return user;
}

result<SimulationUser> choose(std::string_view configured, std::uint32_t server,
                              std::optional<KnownUser> named = std::nullopt,
                              std::uint64_t capabilities = everything)
{
    SimulationUserContext context;
    context.configured = configured;
    context.server = server;
    context.capabilities = capabilities;
    context.named = std::move(named);
    return choose_simulation_user(context);
}

} // namespace

BOOST_AUTO_TEST_CASE(roots_simulations_are_numbers_of_their_own_where_no_user_is_named)
{
    auto const user = choose("auto", 0).value();
    BOOST_TEST((user.kind == Kind::of_its_own));
    BOOST_TEST(user.name == "simulation");
}

BOOST_AUTO_TEST_CASE(a_user_with_the_usual_name_is_taken)
{
    auto const user = choose("auto", 0, known(990)).value();
    BOOST_TEST((user.kind == Kind::one));
    BOOST_TEST(user.user == 990U);
    BOOST_TEST(user.group == 7U);
    BOOST_TEST(user.groups == std::vector<std::uint32_t>{44});
    BOOST_TEST(user.name == "ada");
}

BOOST_AUTO_TEST_CASE(who_shares_the_servers_user_can_use_it_up)
{
    SimulationUser user;
    BOOST_TEST(shared_user_risk(user).starts_with("can take all that the kernel gives this server's user"));
    user.kind = Kind::one;
    BOOST_TEST(shared_user_risk(user).empty());
    user.kind = Kind::of_its_own;
    BOOST_TEST(shared_user_risk(user).empty());
}

BOOST_AUTO_TEST_CASE(other_servers_run_simulations_as_themselves)
{
    BOOST_TEST(!choose("auto", 1000, std::nullopt, 0).value().is_other());
    BOOST_TEST(!choose("auto", 1000, known(990), 0).value().is_other());
}

BOOST_AUTO_TEST_CASE(the_operator_may_want_it_so)
{
    BOOST_TEST(!choose("none", 0).value().is_other());
    BOOST_TEST(!choose("ada", 1000, known(1000), 0).value().is_other()); // the server's own name
    BOOST_TEST((choose("ada", 0, known(990)).value().kind == Kind::one));
}

BOOST_AUTO_TEST_CASE(what_can_not_be_is_refused)
{
    auto const unknown = choose("ada", 0);
    BOOST_TEST(unknown.error().message() == "this machine has no user \"ada\"");
    BOOST_TEST((unknown.error() == errc::invalid_config));
    BOOST_TEST(choose("root2", 0, known(0)).value().is_other() == false); // root under another name
    BOOST_TEST((choose("root", 1000, known(0)).error() == errc::invalid_config));
    auto const powerless = choose("ada", 1000, known(990), 0);
    BOOST_TEST(powerless.error().message() ==
               "only a server that runs as root can start simulations as another user");
}

BOOST_AUTO_TEST_CASE(root_without_its_capabilities_says_which_is_missing)
{
    auto const missing = choose("auto", 0, std::nullopt, everything & ~(std::uint64_t{1} << 7));
    BOOST_TEST((missing.error() == errc::unavailable));
    BOOST_TEST(missing.error().message() == "the server lacks the capability CAP_SETUID");
    BOOST_TEST((choose("ada", 0, known(990), 0).error() == errc::invalid_config));
}

BOOST_AUTO_TEST_CASE(no_two_simulations_have_the_same_number)
{
    std::set<std::uint32_t> numbers;
    for (std::uint64_t turn = 0; turn < 1024; ++turn)
        for (std::uint16_t const port : {1, 2001, 2002, 65535})
            numbers.insert(own_user_number(turn, port));
    BOOST_TEST(numbers.size() == 4 * 1024U);
    BOOST_TEST(*numbers.begin() > 0x6FFF'FFFFU);
    BOOST_TEST(*numbers.rbegin() < 0x7FFE'0000U);
    BOOST_TEST(own_user_number(1024, 2001) == own_user_number(0, 2001));
}

BOOST_AUTO_TEST_CASE(in_a_user_namespace_numbers_are_those_of_the_namespace)
{
    SimulationUser user;
    user.kind = Kind::of_its_own;
    BOOST_TEST(own_user_number(user, 3, 2001) == own_user_number(3, 2001));
    user.user_namespace = 5;
    user.numbers = 2 * 65536 + 7;
    std::set<std::uint32_t> numbers;
    for (std::uint64_t turn = 0; turn < 2; ++turn)
        for (std::uint16_t const port : {0, 2001, 65535})
            numbers.insert(own_user_number(user, turn, port));
    BOOST_TEST(numbers.size() == 6U);
    BOOST_TEST(*numbers.begin() == 1U); // 0 is the server
    BOOST_TEST(*numbers.rbegin() == 2 * 65536U);
    BOOST_TEST(own_user_number(user, 2, 2001) == own_user_number(user, 0, 2001));
}

BOOST_AUTO_TEST_CASE(capabilities_are_read_from_the_kernels_text)
{
    BOOST_TEST(effective_capabilities("Name:\tx\nCapEff:\t000001ffffffffff\nCapBnd:\t0\n") == everything);
    BOOST_TEST(effective_capabilities("CapEff:\t0000000000000000\n") == 0U);
    BOOST_TEST(effective_capabilities("Name:\tx\n") == 0U);
    BOOST_TEST(effective_capabilities("CapEff:") == 0U);
}

BOOST_AUTO_TEST_SUITE_END()
