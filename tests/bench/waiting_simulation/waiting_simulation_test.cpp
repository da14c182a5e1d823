// What docs/scheduling.md promises of the waiting room. All runs are deterministic, so nothing here fails by
// chance.
#include "unit_test.hpp"

#include "scenarios.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

using namespace simulation;

namespace {

constexpr double minute = 60;
constexpr std::uint64_t seeds = 5;

using MakeSite = std::function<Site(std::uint64_t)>;

Site flood_that_would_fill_the_room(std::uint64_t seed)
{
    auto site = quiet_site(seed);
    site.crowds.push_back({"crowd", 5000, site.warm_up + 600, 0, 0});
    return site;
}

MakeSite with_hog(std::size_t browsers)
{
    return [browsers](std::uint64_t seed) { return site_with_hog(seed, browsers); };
}

std::map<std::string, MakeSite> const sites = {{"singles alone", quiet_site},
                                               {"a flood of 200", flooded_site},
                                               {"a class", site_with_class},
                                               {"50 who come again", with_hog(50)},
                                               {"200 who come again", with_hog(200)},
                                               {"an overload", overloaded_site},
                                               {"no hope", hopeless_site},
                                               {"a flood of 5000", flood_that_would_fill_the_room}};

double wait(MakeSite const& site, Rule rule, std::string const& group, double share)
{
    std::vector<double> all;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        auto const some = waits(simulate(under(rule, site(seed))), group);
        all.insert(all.end(), some.begin(), some.end());
    }
    BOOST_TEST(all.size() > 100u, "too few to say anything");
    return quantile(std::move(all), share);
}

} // namespace

using boost::test_tools::tolerance;

BOOST_AUTO_TEST_SUITE(waiting_simulation)

BOOST_AUTO_TEST_CASE(nobody_is_overtaken_by_anybody_who_came_more_than_five_minutes_later)
{
    double longest = 0;
    for (auto const& [name, site] : sites) {
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            auto const day = simulate(site(seed));
            auto const lead = longest_lead(day);
            BOOST_TEST(lead <= 5 * minute + 1e-6, name << ", seed " << seed);
            longest = std::max(longest, lead);
        }
    }
    BOOST_TEST(longest > 4.9 * minute, "the bound is reached");
    BOOST_TEST(longest_lead(simulate(under(Rule::first_come, flooded_site(1)))) == 0.0);
}

BOOST_AUTO_TEST_CASE(a_group_is_late_by_ten_seconds_for_each_seat_that_it_has_or_waits_for)
{
    std::size_t late = 0;
    for (auto const& [name, site] : sites) {
        for (auto const& visit : simulate(site(1)).visits) {
            if (visit.served == visit.arrived)
                continue; // did not wait
            auto const seat = static_cast<double>(visit.seat);
            auto const penalty = visit.rank - visit.arrived;
            BOOST_REQUIRE_SMALL(penalty - std::min(5 * minute, 10 * (seat - 1)), 1e-5);
            BOOST_REQUIRE(penalty <= std::min(5 * minute, 10 * seat) + 1e-5); // of rounding
            late += penalty > 0 ? 1 : 0;
        }
    }
    BOOST_TEST(late > 1000u);
}

BOOST_AUTO_TEST_CASE(singles_are_served_before_who_has_much)
{
    for (std::size_t const browsers : {50u, 200u}) {
        auto const site = with_hog(browsers);
        auto const singles = wait(site, Rule::ours, "", 0.5);
        BOOST_TEST(singles < wait(site, Rule::first_come, "", 0.5) - 4 * minute);
        BOOST_TEST(singles < wait(site, Rule::ours, "crowd", 0.5) - 4 * minute);
    }
    BOOST_TEST(wait(with_hog(0), Rule::ours, "", 0.5) == 0.0, "alone they find a seat");
    BOOST_TEST(wait(flooded_site, Rule::ours, "", 0.5) <
               wait(flooded_site, Rule::first_come, "", 0.5) - minute);
}

BOOST_AUTO_TEST_CASE(who_has_much_is_not_starved)
{
    for (auto const& site :
         {MakeSite(flooded_site), MakeSite(site_with_class), with_hog(50), with_hog(200)}) {
        auto const ours = wait(site, Rule::ours, "crowd", 0.95);
        BOOST_TEST(ours <= wait(site, Rule::first_come, "crowd", 0.95) + 5 * minute);
    }
}

BOOST_AUTO_TEST_CASE(nobody_fills_the_room_alone)
{
    auto const day = simulate(flood_that_would_fill_the_room(1));
    BOOST_TEST(day.refused == 0u);
    BOOST_TEST(day.crowd_refused >= 5000u - 250 - 50);
}

BOOST_AUTO_TEST_CASE(in_an_overload_seats_are_shared_more_evenly)
{
    auto const index = [](Rule rule) {
        auto const site = under(rule, overloaded_site(1));
        auto day = simulate(site);
        std::vector<double> shares;
        for (auto const& crowd : site.crowds)
            shares.push_back(day.seat_time[crowd.group]);
        return jain_index(shares);
    };
    auto const ours = index(Rule::ours);
    BOOST_TEST(ours > index(Rule::first_come) + 0.03);
    BOOST_TEST(ours == 0.23, tolerance(0.05));
    BOOST_TEST(jain_index({3, 3, 3}) == 1.0, tolerance(1e-9));
    BOOST_TEST(jain_index({3, 0, 0}) == 1.0 / 3, tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(where_there_is_no_hope_the_room_is_the_limit)
{
    auto const day = simulate(hopeless_site(1));
    auto const served = static_cast<double>(day.visits.size());
    BOOST_TEST(static_cast<double>(day.refused) / (served + static_cast<double>(day.refused)) == 1.0 / 3,
               tolerance(0.15));
    // A hundred are ahead at most, and a seat comes free every 12 s: 20 minutes.
    BOOST_TEST(quantile(waits(day, ""), 0.5) == 20 * minute, tolerance(0.1));
}

BOOST_AUTO_TEST_CASE(four_of_five_waits_are_in_the_range)
{
    Sessions sessions;
    sessions.length = exponential_length(600);
    sessions.asked_within = minute;
    for (std::size_t const departures : {5u, 30u, 400u}) {
        for (std::size_t const ahead : {0u, 1u, 9u, 49u}) {
            sessions.departures = departures;
            sessions.ahead = ahead;
            auto const found = coverage(sessions);
            BOOST_TEST_CONTEXT(departures << " departures, " << ahead << " ahead")
            {
                BOOST_TEST((found.within > 77 && found.within < 83), found.within);
                BOOST_TEST((found.shorter > 7 && found.longer > 7));
                BOOST_TEST(found.within_rounded >= found.within);
            }
        }
    }
}

BOOST_AUTO_TEST_SUITE_END()
