#include "queues.hpp"

#include "randomness.hpp"

#include <algorithm>
#include <queue>
#include <vector>

namespace simulation {

using namespace webots_cloud;

namespace {

TimePoint at(double time)
{
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(time)));
}

/// In this model a browser is in the queue the moment it was placed, so nothing is pending after a report,
/// and a queue may grow without bound. A job counts one percent.
SchedulerParams params_of(QueueModel const& model)
{
    SchedulerParams params;
    params.policy = model.policy;
    params.custom = model.custom;
    params.seed = model.seed;
    params.threshold = params.memory_threshold = 1e9;
    params.session_cost = 1;
    params.placement_timeout = params.report_lifetime = params.slow_start = Duration::zero();
    return params;
}

class Queues
{
public:
    explicit Queues(QueueModel const& model)
        : model_(model), random_(model.seed), scheduler_(Scheduler::make(params_of(model)).value()),
          length_(model.servers), free_at_(model.servers)
    {
        std::vector<ServerSpec> specs;
        for (std::size_t server = 0; server != model.servers; ++server)
            specs.emplace_back(std::to_string(server));
        scheduler_.set_servers(specs);
        report_all(0);
    }

    double run()
    {
        double const gap = 1 / (model_.arrival_rate * static_cast<double>(model_.servers));
        double next_board = model_.report_age;
        double now = 0;
        double sum = 0;
        for (std::uint64_t arrival = 0; arrival != model_.warm_up + model_.arrivals; ++arrival) {
            now += random_.exponential(gap);
            for (; model_.report_age > 0 && next_board <= now; next_board += model_.report_age) {
                depart_until(next_board);
                report_all(next_board);
            }
            depart_until(now);
            double const time = serve(place(now), now);
            if (arrival >= model_.warm_up)
                sum += time;
        }
        return sum / static_cast<double>(model_.arrivals);
    }

private:
    struct Departure
    {
        double when;
        std::size_t server;
        bool operator>(Departure const& other) const { return when > other.when; }
    };

    std::size_t place(double now)
    {
        std::string_view const address = scheduler_.place(at(now)).value().address;
        std::size_t server = 0;
        for (char const digit : address)
            server = 10 * server + static_cast<std::size_t>(digit - '0');
        return server;
    }

    double serve(std::size_t server, double now)
    {
        free_at_[server] = std::max(free_at_[server], now) + random_.exponential(1);
        departures_.push({free_at_[server], server});
        ++length_[server];
        if (model_.report_age == 0)
            report(server, now);
        return free_at_[server] - now;
    }

    void depart_until(double now)
    {
        while (!departures_.empty() && departures_.top().when <= now) {
            Departure const departure = departures_.top();
            departures_.pop();
            --length_[departure.server];
            if (model_.report_age == 0)
                report(departure.server, departure.when);
        }
    }

    void report(std::size_t server, double now)
    {
        LoadReport report(length_[server]);
        report.sessions = length_[server];
        report.starting = 0;
        scheduler_.report(std::to_string(server), report, at(now));
    }

    void report_all(double now)
    {
        for (std::size_t server = 0; server != model_.servers; ++server)
            report(server, now);
    }

    QueueModel const& model_;
    Randomness random_;
    Scheduler scheduler_;
    std::vector<int> length_;
    std::vector<double> free_at_;
    std::priority_queue<Departure, std::vector<Departure>, std::greater<>> departures_;
};

} // namespace

double mean_time_in_system(QueueModel const& model)
{
    return Queues(model).run();
}

double shortest_queue_time(QueueModel const& model)
{
    Randomness random(model.seed);
    // By length: the servers of that length are interchangeable, so their number is all that matters; the
    // time in system follows from the mean number of jobs by Little's law.
    std::vector<std::size_t> with_length(1, model.servers);
    double const arrivals_per_time = model.arrival_rate * static_cast<double>(model.servers);
    double job_time = 0;
    double time = 0;
    std::uint64_t arrived = 0;
    std::size_t jobs = 0;
    std::size_t busy = 0;
    while (arrived != model.warm_up + model.arrivals) {
        double const step = random.exponential(1 / (arrivals_per_time + static_cast<double>(busy)));
        if (arrived >= model.warm_up) {
            time += step;
            job_time += step * static_cast<double>(jobs);
        }
        if (random.chance(arrivals_per_time / (arrivals_per_time + static_cast<double>(busy)))) {
            std::size_t length = 0;
            while (with_length[length] == 0)
                ++length;
            with_length.resize(std::max(with_length.size(), length + 2));
            --with_length[length];
            ++with_length[length + 1];
            busy += length == 0;
            ++jobs;
            ++arrived;
        } else {
            auto server = static_cast<std::size_t>(random.uniform() * static_cast<double>(busy));
            std::size_t length = 1;
            while (server >= with_length[length])
                server -= with_length[length++];
            --with_length[length];
            ++with_length[length - 1];
            busy -= length == 1;
            --jobs;
        }
    }
    return job_time / time / arrivals_per_time;
}

SchedulingPolicy best_of(std::size_t choices)
{
    return [choices](PlacementSnapshot const& machines, RandomSource& random) {
        // Floyd's sampling: every set of that size is equally likely.
        std::vector<std::size_t> drawn;
        for (std::size_t last = machines.size() - choices; last != machines.size(); ++last) {
            std::size_t const candidate = random.below(last + 1);
            bool const taken = std::ranges::find(drawn, candidate) != drawn.end();
            drawn.push_back(taken ? last : candidate);
        }
        std::size_t best = drawn.front();
        for (std::size_t const position : drawn)
            if (machines[position].load < machines[best].load)
                best = position;
        return best;
    };
}

} // namespace simulation
