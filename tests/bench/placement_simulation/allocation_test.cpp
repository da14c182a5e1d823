// Placing allocates nothing, and machines that left the list leave nothing behind: counted by an operator new
// of this program's own.
#include <webots_cloud/scheduler.hpp>

#include <cstdlib>
#include <iostream>
#include <new>
#include <string>
#include <vector>

namespace {

std::size_t allocations = 0;
std::size_t releases = 0;

} // namespace

[[gnu::noinline]] void* operator new(std::size_t size)
{
    ++allocations;
    if (void* const memory = std::malloc(size))
        return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::nothrow_t const&) noexcept
{
    ++allocations;
    return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    releases += memory != nullptr;
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    operator delete(memory);
}

using namespace webots_cloud;
using std::chrono::seconds;

namespace {

/// How often 200 placements on `size` machines allocate, with reports, and others' sessions, in between.
std::size_t allocations_of(char const* policy, std::size_t size)
{
    SchedulerParams params;
    params.policy = policy;
    auto scheduler = Scheduler::make(params).value();
    std::vector<std::string> names;
    for (std::size_t machine = 0; machine != size; ++machine)
        names.push_back("a-rather-long-name-of-machine-" + std::to_string(machine) + ":2000");
    scheduler.set_servers(std::vector<ServerSpec>(names.begin(), names.end()));
    TimePoint now = TimePoint(std::chrono::hours(1));
    std::size_t const before = allocations;
    for (int round = 0; round != 4; ++round, now += seconds(5)) {
        for (std::string const& name : names) {
            LoadReport report(4.0 * round);
            report.sessions = 2 * round; // not all of them ours
            report.starting = 0;
            scheduler.report(name, report, now);
        }
        for (int session = 0; session != 50; ++session)
            scheduler.place(now).value();
    }
    return allocations - before;
}

/// How many more allocations 1000 lists of ever new machines, with a placement each, hold than 200 of them.
std::size_t growth()
{
    Scheduler scheduler;
    TimePoint const now = TimePoint(std::chrono::hours(1));
    std::size_t held = 0;
    for (int list = 0; list != 1000; ++list) {
        if (list == 200) // the last hundred decisions keep their names
            held = allocations - releases;
        std::string const name = "a-rather-long-name-of-machine-" + std::to_string(list) + ":2000";
        scheduler.set_servers({ServerSpec(name)});
        scheduler.report(name, LoadReport(0), now);
        scheduler.place(now).value();
    }
    return allocations - releases - held;
}

} // namespace

int main()
{
    int failures = 0;
    if (std::size_t const count = growth(); count != 0) {
        std::cerr << "names of machines that left the list: " << count << " allocations are never released\n";
        ++failures;
    }
    for (char const* const policy : {"least_committed", "least_reported", "random", "power_of_two"})
        for (std::size_t const size : {50, 1000})
            if (std::size_t const count = allocations_of(policy, size); count != 0) {
                std::cerr << policy << " among " << size << " machines allocates " << count << " times\n";
                ++failures;
            }
    return failures;
}
