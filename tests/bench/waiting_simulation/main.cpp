// waiting_simulation: the tables of "The waiting room" in docs/scheduling.md.
#include "scenarios.hpp"
#include "table.hpp"

#include "core/waiting/wait_estimate.hpp"
#include "core/waiting/waiting_ticket.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <functional>
#include <iostream>

#include <malloc.h>

namespace simulation {
namespace {

constexpr std::uint64_t seeds = 20;

struct Customer : webots_cloud::core::WaitingRoom::Customer
{
    using webots_cloud::core::WaitingRoom::Customer::Customer;
};

std::string minutes(double seconds)
{
    return decimals(seconds / 60, 1);
}

struct Summary
{
    std::vector<double> singles;
    std::vector<double> crowd;
    double lead = 0;
};

Summary of_all_seeds(std::function<Site(std::uint64_t)> const& site, Rule rule)
{
    Summary all;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        auto const day = simulate(under(rule, site(seed)));
        auto const singles = waits(day, "");
        auto const crowd = waits(day, "crowd");
        all.singles.insert(all.singles.end(), singles.begin(), singles.end());
        all.crowd.insert(all.crowd.end(), crowd.begin(), crowd.end());
        all.lead = std::max(all.lead, longest_lead(day));
    }
    return all;
}

void fairness()
{
    std::cout << "Waits in minutes, " << seeds << " seeds:\n\n";
    print_heading(std::cout, {"", "singles, median", "singles, 95 %", "crowd, median", "crowd, 95 %",
                              "came later, yet was served before, at most"});
    auto const row = [](std::string const& name, std::function<Site(std::uint64_t)> const& site, Rule rule) {
        auto const all = of_all_seeds(site, rule);
        bool const has_crowd = !all.crowd.empty();
        print_row(std::cout, {name, minutes(quantile(all.singles, 0.5)), minutes(quantile(all.singles, 0.95)),
                              has_crowd ? minutes(quantile(all.crowd, 0.5)) : "-",
                              has_crowd ? minutes(quantile(all.crowd, 0.95)) : "-", minutes(all.lead)});
    };
    auto const rows = [&](std::string const& name, std::function<Site(std::uint64_t)> const& site) {
        row(name + ", first come first served", site, Rule::first_come);
        row(name, site, Rule::ours);
        row(name + ", at most 30 min", site, Rule::half_an_hour);
    };
    row("singles alone, 90 % of the seats", quiet_site, Rule::ours);
    rows("200 at once", flooded_site);
    rows("a class of 30", site_with_class);
    row(
        "singles alone, 50 % of the seats", [](std::uint64_t seed) { return site_with_hog(seed, 0); },
        Rule::ours);
    rows("beside 50 who come again", [](std::uint64_t seed) { return site_with_hog(seed, 50); });
    rows("beside 200 who come again", [](std::uint64_t seed) { return site_with_hog(seed, 200); });
    row("half again too many singles, 100 places", hopeless_site, Rule::ours);
}

void shares()
{
    std::cout << "\nAn overload, " << seeds << " seeds, seats on average:\n\n";
    print_heading(std::cout, {"", "addresses with 1", "with 4", "with 40", "Jain's index"});
    for (auto const& [name, rule] : {std::pair("first come first served", Rule::first_come),
                                     {"ours", Rule::ours},
                                     {"at most 30 min", Rule::half_an_hour}}) {
        std::map<std::string, double> time;
        auto const site = overloaded_site(1);
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            for (auto const& [group, seconds] : simulate(under(rule, overloaded_site(seed))).seat_time)
                time[group] += seconds / site.lasts / static_cast<double>(seeds);
        }
        std::map<std::size_t, std::pair<double, double>> of_size; // sum, count
        std::vector<double> all;
        for (auto const& crowd : site.crowds) {
            all.push_back(time[crowd.group]);
            of_size[crowd.browsers].first += time[crowd.group];
            of_size[crowd.browsers].second += 1;
        }
        auto const mean = [&](std::size_t size) {
            return decimals(of_size[size].first / of_size[size].second, 2);
        };
        print_row(std::cout, {name, mean(1), mean(4), mean(40), decimals(jain_index(all), 3)});
    }
}

void estimates()
{
    std::cout << "\nWaits within the range, 4000 trials of 20 seats:\n\n";
    print_heading(std::cout, {"sessions", "departures seen", "ahead", "within %", "as rounded %", "shorter %",
                              "longer %", "most / least"});
    auto const row = [](std::string const& name, Sessions const& sessions) {
        auto const found = coverage(sessions);
        print_row(std::cout,
                  {name, std::to_string(sessions.departures), std::to_string(sessions.ahead),
                   decimals(found.within, 1), decimals(found.within_rounded, 1), decimals(found.shorter, 1),
                   decimals(found.longer, 1), decimals(found.median_ratio, 1)});
    };
    auto const rows = [&](std::string const& name, Sessions sessions) {
        for (auto const& [departures, ahead] : {std::pair<std::size_t, std::size_t>(5, 0),
                                                {5, 9},
                                                {30, 0},
                                                {30, 9},
                                                {400, 0},
                                                {400, 9},
                                                {400, 49}}) {
            sessions.departures = departures;
            sessions.ahead = ahead;
            row(name, sessions);
        }
    };
    Sessions sessions;
    sessions.asked_within = 60;
    sessions.length = exponential_length(600);
    rows("exponential, 10 min", sessions);
    sessions.length = log_normal_length(600, 0.5);
    rows("log-normal, sigma 0.5", sessions);
    sessions.length = log_normal_length(600, 1.5);
    rows("log-normal, sigma 1.5", sessions);
    sessions.length = lesson_length(45 * 60);
    sessions.begin_within = 60;
    for (auto const& [departures, ahead] : {std::pair<std::size_t, std::size_t>(20, 0), {20, 9}, {60, 9}}) {
        sessions.departures = departures;
        sessions.ahead = ahead;
        sessions.asked_within = 45 * 60;
        row("lessons of 45 min that end together", sessions);
    }
}

void cost()
{
    using namespace webots_cloud;
    constexpr std::uint64_t count = 10'000;
    core::WaitingRoomParams params;
    params.places = count;
    auto const microseconds = [](auto const& work, double times) {
        auto const began = std::chrono::steady_clock::now();
        work();
        return decimals(
            std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count() /
                times,
            2);
    };
    core::WaitingRoom room(params);
    core::WaitingTickets tickets;
    WallTime const noon{std::chrono::hours(400'000)};
    std::deque<Customer> customers;
    for (std::uint64_t id = 0; id != count; ++id) {
        auto& customer = customers.emplace_back(id);
        customer.group = std::to_string(10'000'000 + id % 2500); // 8 bytes
        customer.rank = noon + std::chrono::milliseconds(id * 100);
    }
    auto const used = ::mallinfo2().uordblks - sizeof(Customer) * count;
    std::uint64_t sum = 0;
    std::cout << "\n10,000 who wait, microseconds:\n\n";
    print_heading(std::cout, {"enter", "ahead_of the last who came", "visit all", "leave, the first",
                              "expect", "bytes each, with its ticket"});
    auto const enter = microseconds(
        [&] {
            for (auto& customer : customers)
                room.enter(customer, 0);
        },
        count);
    for (std::uint64_t id = 0; id != count; ++id) {
        core::WaitingId ticket{};
        std::memcpy(ticket.data(), &id, sizeof id);
        tickets.enter(ticket, "8 bytes.", id);
    }
    auto const bytes = std::to_string((::mallinfo2().uordblks - used) / count);
    auto const ahead = microseconds([&] { sum += room.ahead_of(customers.back()); }, 1);
    auto const visit = microseconds(
        [&] {
            for (std::size_t place = 0; place != count; ++place)
                sum += room.at(place).id;
        },
        1);
    auto const leave = microseconds(
        [&] {
            while (room.size() > 0)
                room.leave(room.at(0));
        },
        count);
    core::WaitEstimate estimate;
    TimePoint now{std::chrono::hours(1000)};
    for (int session = 0; session != 10; ++session) {
        estimate.session_began(now);
        now += std::chrono::seconds(1);
        estimate.session_ended(now);
        estimate.session_began(now);
    }
    auto const expect = microseconds(
        [&] {
            for (std::size_t ahead_of_it = 0; ahead_of_it != count; ++ahead_of_it)
                sum += static_cast<std::uint64_t>(estimate.expect(ahead_of_it, now)->most.count());
        },
        count);
    print_row(std::cout, {enter, ahead, visit, leave, expect, bytes});
    if (sum == 0)
        std::cout << '\n'; // so that the compiler can't leave out what is measured
}

} // namespace
} // namespace simulation

int main()
{
    simulation::fairness();
    simulation::shares();
    simulation::estimates();
    simulation::cost();
}
