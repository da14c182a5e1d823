#include "unit_test.hpp"

#include "core/simulation/start_refusal.hpp"

#include <vector>

using namespace webots_cloud;

// Protocol 4.1.5.
BOOST_AUTO_TEST_SUITE(start_refusal)

using Step = core::StartStep;
using Refusal = core::StartRefusal;

namespace {

constexpr errc all[] = {errc::invalid_argument, errc::invalid_config, errc::invalid_url,  errc::refused,
                        errc::unavailable,      errc::not_found,      errc::unreachable,  errc::timed_out,
                        errc::too_large,        errc::protocol_error, errc::start_failed, errc::closed};

/// Which codes mean that at this step.
std::vector<errc> codes_of(Step step, Refusal refusal)
{
    std::vector<errc> codes;
    for (auto const code : all)
        if (core::refusal_at(step, code) == refusal)
            codes.push_back(code);
    return codes;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_machine_that_takes_no_start_speaks_for_itself_but_of_wrong_addresses)
{
    for (auto const code : all) {
        auto const expected = code == errc::unavailable   ? Refusal::full
                              : code == errc::invalid_url ? Refusal::everywhere
                                                          : Refusal::here;
        BOOST_TEST((core::refusal_at(Step::admission, code) == expected), make_error_code(code).message());
    }
}

BOOST_AUTO_TEST_CASE(a_project_that_can_not_be_fetched_is_at_fault_unless_this_machine_is)
{
    BOOST_TEST((codes_of(Step::repository, Refusal::here) ==
                std::vector<errc>{errc::unavailable, errc::unreachable}));
    BOOST_TEST(codes_of(Step::repository, Refusal::full).empty());
}

BOOST_AUTO_TEST_CASE(which_websites_may_start_what_is_a_matter_of_each_machine)
{
    BOOST_TEST((codes_of(Step::website, Refusal::here) ==
                std::vector<errc>{errc::refused, errc::unavailable, errc::not_found, errc::unreachable}));
    BOOST_TEST(codes_of(Step::website, Refusal::full).empty());
}

BOOST_AUTO_TEST_CASE(a_launch_fails_here_unless_it_can_not_be_done_at_all)
{
    BOOST_TEST((codes_of(Step::launch, Refusal::everywhere) ==
                std::vector<errc>{errc::invalid_argument, errc::too_large}));
    BOOST_TEST(codes_of(Step::launch, Refusal::full).empty());
}

BOOST_AUTO_TEST_CASE(a_row_of_the_table_knows_better_than_its_code)
{
    using core::Refused;
    using core::refused;
    auto const too_large = refused(Refused::memory_overrun, {{"max", "2"}});
    BOOST_TEST((core::refusal_at(Step::launch, too_large) == Refusal::everywhere));
    auto const unreachable = refused(Refused::site_unreachable, {{"site", "s"}, {"why", "w"}});
    BOOST_TEST((core::refusal_at(Step::repository, unreachable) == Refusal::here));
    auto const full = refused(Refused::no_place, {{"max", "2"}});
    BOOST_TEST((core::refusal_at(Step::admission, full) == Refusal::full));
    BOOST_TEST((core::refusal_at(Step::launch, full) == Refusal::here), "others have taken its ports");
    auto const no_template = refused(Refused::no_template, {{"name", "n"}});
    BOOST_TEST((core::refusal_at(Step::website, no_template) == Refusal::here));
}

BOOST_AUTO_TEST_CASE(errors_of_the_system_are_this_machines)
{
    for (auto const step : {Step::admission, Step::repository, Step::website, Step::launch})
        for (auto const code : {boost::system::errc::no_space_on_device,
                                boost::system::errc::too_many_files_open, boost::system::errc::io_error}) {
            auto const failure = Failure(boost::system::errc::make_error_code(code));
            BOOST_TEST((core::refusal_at(step, failure) == Refusal::here), failure.message());
        }
}

BOOST_AUTO_TEST_CASE(session_servers_are_told_nothing_of_what_is_refused_everywhere)
{
    BOOST_TEST(core::refusal_message(Refusal::full) == "refusal: full");
    BOOST_TEST(core::refusal_message(Refusal::here) == "refusal: machine");
    BOOST_TEST(core::refusal_message(Refusal::everywhere) == "");
    BOOST_TEST(core::needs_message({"gpu", "docker"}) == "refusal: needs gpu docker");
}

BOOST_AUTO_TEST_SUITE_END()
