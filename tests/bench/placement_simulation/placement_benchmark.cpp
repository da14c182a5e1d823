// What a placement and a report cost, by number of machines.
#include <webots_cloud/scheduler.hpp>

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <new>
#include <string>
#include <vector>

namespace {

std::size_t allocations = 0;

} // namespace

[[gnu::noinline]] void* operator new(std::size_t size)
{
    ++allocations;
    if (void* const memory = std::malloc(size))
        return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}

namespace {

using namespace webots_cloud;
using std::chrono::microseconds;

/// Machines that never fill up, so that every iteration does the same work.
class Fleet
{
public:
    Fleet(std::size_t size, std::string policy)
    {
        SchedulerParams params;
        params.policy = std::move(policy);
        params.threshold = 1e9;
        params.report_lifetime = Duration::zero();
        scheduler = Scheduler::make(params).value();
        for (std::size_t machine = 0; machine != size; ++machine)
            names.push_back("simulation-" + std::to_string(machine) + ".example.org:2000");
        std::vector<ServerSpec> specs(names.begin(), names.end());
        scheduler.set_servers(specs);
        for (int round = 0; round != 3; ++round)
            for (std::size_t machine = 0; machine != size; ++machine)
                report(machine, 8);
    }

    void report(std::size_t machine, int sessions)
    {
        now += microseconds(500); // 10,000 machines every 5 s
        LoadReport report(static_cast<double>((machine * 7919) % 90) + sessions);
        report.sessions = sessions;
        report.starting = sessions % 2;
        report.capacity = 1'000'000'000;
        scheduler.report(names[machine], report, now);
    }

    std::vector<std::string> names;
    Scheduler scheduler;
    TimePoint now = TimePoint(std::chrono::hours(1));
};

void place(benchmark::State& state, char const* policy)
{
    Fleet fleet(static_cast<std::size_t>(state.range(0)), policy);
    std::size_t const before = allocations;
    for (auto _ : state) {
        fleet.now += microseconds(50);
        benchmark::DoNotOptimize(fleet.scheduler.place(fleet.now));
    }
    state.counters["allocations"] = static_cast<double>(allocations - before);
}

/// Others place on the same machines, so that the water level has to be found.
void place_among_others(benchmark::State& state)
{
    auto const size = static_cast<std::size_t>(state.range(0));
    Fleet fleet(size, "least_committed");
    for (int round = 9; round != 12; ++round)
        for (std::size_t machine = 0; machine != size; ++machine)
            fleet.report(machine, round);
    std::size_t const before = allocations;
    for (auto _ : state) {
        fleet.now += microseconds(50);
        benchmark::DoNotOptimize(fleet.scheduler.place(fleet.now));
    }
    state.counters["allocations"] = static_cast<double>(allocations - before);
}

void report(benchmark::State& state)
{
    auto const size = static_cast<std::size_t>(state.range(0));
    Fleet fleet(size, "least_committed");
    std::size_t machine = 0;
    int sessions = 8;
    std::size_t const before = allocations;
    for (auto _ : state) {
        fleet.report(machine, sessions);
        if (++machine == size) {
            machine = 0;
            ++sessions;
        }
    }
    state.counters["allocations"] = static_cast<double>(allocations - before);
}

BENCHMARK_CAPTURE(place, least_committed, "least_committed")->Arg(10)->Arg(1'000)->Arg(10'000);
BENCHMARK_CAPTURE(place, least_reported, "least_reported")->Arg(10'000);
BENCHMARK_CAPTURE(place, power_of_two, "power_of_two")->Arg(10'000);
BENCHMARK_CAPTURE(place, random, "random")->Arg(10'000);
BENCHMARK(place_among_others)->Arg(10)->Arg(1'000)->Arg(10'000);
BENCHMARK(report)->Arg(10)->Arg(1'000)->Arg(10'000);

} // namespace

BENCHMARK_MAIN();
