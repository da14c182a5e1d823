#include "unit_test.hpp"

#include "adapters/projects/fetch_budget.hpp"

#include <random>
#include <thread>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
using namespace std::chrono_literals;

namespace {

FetchBytes bytes(std::uint64_t memory, std::uint64_t disk = 0)
{
    FetchBytes made;
    made.memory = memory;
    made.disk = disk;
    return made;
}

struct FetchBudgetFixture
{
    FetchShare::Waiting patient(Duration patience = 30s)
    {
        FetchShare::Waiting waiting;
        waiting.patience = patience;
        waiting.tell = [this](bool waits) { told.push_back(waits); };
        return waiting;
    }

    bool is_empty() const
    {
        return budget->taken().memory == 0 && budget->taken().disk == 0 && budget->holding == 0;
    }

    std::shared_ptr<FetchBudget> budget = make_fetch_budget(100, 1000);
    std::vector<bool> told;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(fetch_budget, FetchBudgetFixture)

BOOST_AUTO_TEST_CASE(what_does_not_fit_takes_nothing)
{
    BOOST_TEST(budget->take(bytes(60, 600)));
    BOOST_TEST(!budget->take(bytes(41)));
    BOOST_TEST(!budget->take(bytes(40, 401)));
    BOOST_TEST(budget->taken().memory == 60u);
    BOOST_TEST(budget->take(bytes(40, 400)));
    BOOST_TEST(!budget->take(bytes(1)));
    BOOST_TEST(!budget->take(bytes(~std::uint64_t{0}, ~std::uint64_t{0})));
    budget->give_back(bytes(100, 1000));
    BOOST_TEST(is_empty());
}

BOOST_AUTO_TEST_CASE(what_is_there_already_is_counted_beyond_the_limit)
{
    budget->take_anyway(bytes(150));
    BOOST_TEST(!budget->take(bytes(1)));
    BOOST_TEST(budget->take(bytes(0, 1000)));
    budget->give_back(bytes(150, 1000));
    BOOST_TEST(is_empty());
}

BOOST_AUTO_TEST_CASE(a_grant_is_given_back_once_wherever_it_went)
{
    {
        FetchGrant grant(budget);
        BOOST_TEST(grant.take(bytes(50)));
        FetchGrant moved(std::move(grant));
        FetchGrant assigned;
        assigned = std::move(moved);
        BOOST_TEST(budget->taken().memory == 50u);
        BOOST_TEST(!assigned.take(bytes(51)));
        assigned.give_back(bytes(20));
        BOOST_TEST(budget->taken().memory == 30u);
    }
    BOOST_TEST(is_empty());
    FetchGrant nobody_counts;
    BOOST_TEST(nobody_counts.take(bytes(1 << 30)));
}

BOOST_AUTO_TEST_CASE(a_share_gives_back_what_it_has_and_a_loan_what_came_since)
{
    {
        FetchShare share(budget, patient());
        BOOST_TEST(share.take(bytes(10, 10)).has_value());
        {
            FetchShare::Loan const loan(share);
            BOOST_TEST(share.take(bytes(20)).has_value());
            BOOST_TEST(budget->taken().memory == 30u);
            BOOST_TEST(budget->holding == 1);
        }
        BOOST_TEST(budget->taken().memory == 10u);
    }
    BOOST_TEST(is_empty());
}

BOOST_AUTO_TEST_CASE(what_can_never_fit_is_refused_at_once_with_the_key_to_raise)
{
    FetchShare share(budget, patient());
    BOOST_TEST(share.take(bytes(10)).has_value());
    auto const memory = share.take(bytes(91));
    BOOST_TEST((memory.error() == errc::too_large));
    BOOST_TEST(memory.error().message().find("Its operator can raise \"fetchMemory\".") != std::string::npos);
    auto const disk = share.take(bytes(1, 1001));
    BOOST_TEST((disk.error() == errc::too_large));
    BOOST_TEST(disk.error().message().find("\"fetchDisk\"") != std::string::npos);
    BOOST_TEST(told.empty());
    BOOST_TEST(budget->taken().memory == 10u);
}

BOOST_AUTO_TEST_CASE(who_does_not_fit_waits_until_somebody_gives_back)
{
    auto first = std::make_unique<FetchShare>(budget, FetchShare::Waiting());
    BOOST_TEST(first->take(bytes(90)).has_value());
    int asked = 0;
    auto waiting = patient();
    waiting.interrupt = [&]() -> result<> {
        if (++asked == 2)
            first.reset();
        return {};
    };
    FetchShare second(budget, std::move(waiting));
    BOOST_TEST(second.take(bytes(50)).has_value());
    BOOST_TEST(told == (std::vector<bool>{true, false}), boost::test_tools::per_element());
    BOOST_TEST(budget->taken().memory == 50u);
    BOOST_TEST(budget->waiting == 0);
}

BOOST_AUTO_TEST_CASE(a_wait_ends_with_patience_and_when_it_is_told_to)
{
    FetchShare first(budget, patient());
    BOOST_TEST(first.take(bytes(90)).has_value());
    FetchShare impatient(budget, patient(0s));
    auto const refused = impatient.take(bytes(50));
    BOOST_TEST((refused.error() == errc::unavailable));
    BOOST_TEST(refused.error().message().find("Try again in a minute.") != std::string::npos);
    auto waiting = patient();
    waiting.interrupt = [] { return result<>(Failure(errc::timed_out)); };
    FetchShare told_to_stop(budget, std::move(waiting));
    BOOST_TEST((told_to_stop.take(bytes(50)).error() == errc::timed_out));
    BOOST_TEST(budget->waiting == 0);
    BOOST_TEST(budget->taken().memory == 90u);
}

BOOST_AUTO_TEST_CASE(who_waits_for_nobody_gives_up)
{
    FetchShare alone(budget, patient());
    BOOST_TEST(alone.take(bytes(50)).has_value());
    budget->take_anyway(bytes(50)); // never released
    BOOST_TEST((alone.take(bytes(1)).error() == errc::unavailable));
    budget->give_back(bytes(50));
}

BOOST_AUTO_TEST_CASE(when_all_wait_for_each_other_one_gives_up_and_the_other_goes_on)
{
    auto third = std::make_unique<FetchShare>(budget, patient());
    BOOST_TEST(third->take(bytes(10)).has_value());
    auto large = std::make_unique<FetchShare>(budget, FetchShare::Waiting());
    BOOST_TEST(large->take(bytes(50)).has_value());
    std::atomic<int> succeeded = 0;
    std::thread other;
    {
        auto waiting = patient();
        waiting.interrupt =
            [&]() -> result<> { // when both wait, the third fetch, still running, releases its share
            if (budget->waiting == 2)
                third.reset();
            return {};
        };
        FetchShare small(budget, std::move(waiting));
        BOOST_TEST(small.take(bytes(40)).has_value());
        other = std::thread([&] {
            succeeded += large->take(bytes(45)) ? 1 : 0;
            large.reset();
        });
        succeeded += small.take(bytes(50)) ? 1 : 0;
    }
    other.join();
    BOOST_TEST(succeeded == 1);
    BOOST_TEST(is_empty());
    BOOST_TEST(!budget->yielding);
}

BOOST_AUTO_TEST_CASE(whatever_many_threads_do_the_limits_hold_and_all_is_given_back)
{
    std::atomic<bool> exceeded{false};
    std::vector<std::thread> threads;
    for (unsigned seed = 0; seed < 4; ++seed)
        threads.emplace_back([&, seed] {
            std::minstd_rand random(seed + 1);
            for (int round = 0; round < 2000; ++round) {
                FetchShare share(budget, FetchShare::Waiting{{}, {}, 0s});
                for (int i = 0; i < 4; ++i)
                    (void)share.take(bytes(random() % 40, random() % 400));
                auto const taken = budget->taken();
                if (taken.memory > 100 || taken.disk > 1000)
                    exceeded = true;
            }
        });
    for (auto& thread : threads)
        thread.join();
    BOOST_TEST(!exceeded);
    BOOST_TEST(is_empty());
    BOOST_TEST(budget->waiting == 0);
}

BOOST_AUTO_TEST_SUITE_END()
