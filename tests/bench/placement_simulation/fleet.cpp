#include "fleet.hpp"

#include "randomness.hpp"

#include <webots_cloud/scheduler.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <queue>
#include <string>
#include <utility>
#include <vector>

namespace simulation {

using namespace webots_cloud;

namespace {

constexpr double day = 86'400;
constexpr double hour = 3600;
constexpr double travel = 1;         // s until a browser arrives at its machine
constexpr double visible_after = 20; // s until its load shows
constexpr double noise = 2;          // percent of a report, either way
constexpr int class_size = 30;
constexpr double class_window = 120;  // s
constexpr double before_lesson = 300; // s

/// How many come in each hour, in proportion: a weekday of a university.
constexpr std::array<double, 24> rhythm = {2,  1,  1,  1,  1,  2,  5,  20, 60, 90, 100, 90,
                                           50, 80, 95, 90, 70, 45, 30, 28, 25, 18, 10,  5};

TimePoint at(double time)
{
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(hour + time)));
}

struct Session
{
    double load;
    double visible;
};

struct Machine
{
    enum class State
    {
        off,
        boots,
        runs,
        drains
    };

    State state = State::off;
    bool is_listed = false; ///< Session servers know it.
    double since = 0;       ///< It boots, or runs.
    std::vector<std::pair<std::uint64_t, Session>> sessions;
    std::int64_t arrivals = 0;
    double wanted = 0;
};

struct Browser
{
    double arrived;
    double load;
    double stays;
};

/// Something that will happen: a browser reaches its machine, or leaves it.
struct Event
{
    double when;
    std::uint64_t session;
    std::size_t machine;
    std::size_t server;
    Browser browser; ///< Of one that arrives.
    bool is_arrival;

    bool operator>(Event const& other) const { return when > other.when; }
};

class Weekday
{
public:
    Weekday(Fleet const& fleet, std::uint64_t seed)
        : fleet_(fleet), random_(seed), machines_(fleet.max_machines), lines_(fleet.session_servers)
    {
        for (std::size_t server = 0; server != fleet.session_servers; ++server) {
            SchedulerParams params;
            params.seed = seed * 1000 + server;
            schedulers_.push_back(Scheduler::make(params).value());
        }
        for (std::size_t number = 0; number != machines_.size(); ++number) {
            names_.push_back(std::to_string(number));
            if (fleet.is_fixed || number < fleet.min_machines)
                machines_[number].state = Machine::State::runs;
        }
        list_machines(0);
        per_hour_ = fleet.browsers / sum_of_rhythm();
    }

    FleetFigures run()
    {
        for (double now = -2 * fleet_.report_every; now < day; ++now) {
            happen(now);
            if (!fleet_.is_fixed && std::fmod(now, fleet_.decide_every) == 0)
                scale(now);
            if (std::fmod(now, fleet_.discovery) == 0)
                list_machines(now);
            report(now);
            if (now >= 0)
                come(now);
            for (std::size_t server = 0; server != lines_.size(); ++server)
                serve_line(server, now);
            measure(now);
        }
        return figures();
    }

private:
    using State = Machine::State;

    static double sum_of_rhythm()
    {
        double sum = 0;
        for (double const part : rhythm)
            sum += part;
        return sum;
    }

    /// Browsers that reach their machine, and sessions that end.
    void happen(double now)
    {
        while (!events_.empty() && events_.top().when <= now) {
            auto const event = events_.top();
            events_.pop();
            auto& machine = machines_[event.machine];
            if (!event.is_arrival) {
                auto const gone = std::ranges::find(machine.sessions, event.session,
                                                    &std::pair<std::uint64_t, Session>::first);
                machine.wanted -= gone->second.load;
                machine.sessions.erase(gone);
                --sessions_;
                if (machine.state == State::drains && machine.sessions.empty())
                    machine.state = State::off;
            } else if (machine.state != State::runs ||
                       machine.sessions.size() >= static_cast<std::size_t>(fleet_.seats)) {
                lines_[event.server].push_front(event.browser); // the machine says so, and another is tried
            } else {
                ++machine.arrivals;
                machine.sessions.emplace_back(event.session,
                                              Session{event.browser.load, now + visible_after});
                machine.wanted += event.browser.load;
                ++sessions_;
                note_wait(now - travel - event.browser.arrived);
                events_.push({now + event.browser.stays, event.session, event.machine, event.server,
                              event.browser, false});
            }
        }
    }

    /// Keeps a part of the seats free, by what the first session server reckons.
    void scale(double now)
    {
        std::size_t booting = 0;
        for (auto& machine : machines_) {
            if (machine.state == State::boots && machine.since + fleet_.boot <= now)
                machine.state = State::runs;
            booting += machine.state == State::boots || (machine.state == State::runs && !machine.is_listed);
        }
        std::size_t waiting = 0;
        for (auto const& line : lines_)
            waiting += line.size();
        double reserve = std::max(fleet_.reserve * static_cast<double>(sessions_),
                                  static_cast<double>(fleet_.min_machines));
        if (double const lesson = std::fmod(now + before_lesson, hour);
            fleet_.knows_timetable && now >= 0 && lesson < before_lesson + class_window) {
            auto const of_hour = static_cast<std::size_t>((now + before_lesson) / hour) % rhythm.size();
            reserve += per_hour_ * rhythm.at(of_hour) * fleet_.in_lessons;
        }
        double const free = static_cast<double>(schedulers_.front().free_seats(at(now))) -
                            static_cast<double>(waiting) +
                            static_cast<double>(booting) * static_cast<double>(fleet_.seats);
        auto const missing = static_cast<long>(std::ceil((reserve - free) / fleet_.seats));
        if (missing > 0) {
            wanted_at_ = now;
            add(static_cast<std::size_t>(missing), now);
        } else if (now - wanted_at_ >= fleet_.calm && booting == 0) {
            // A tenth of what is too much at a time, since lessons end at once and others begin.
            remove(static_cast<std::size_t>(-missing) / 10);
        }
    }

    void add(std::size_t count, double now)
    {
        for (auto& machine : machines_) {
            if (count == 0)
                return;
            if (machine.state == State::drains) { // nothing has to boot
                machine.state = State::runs;
                --count;
            }
        }
        for (auto& machine : machines_) {
            if (count == 0)
                return;
            if (machine.state == State::off) {
                machine.state = State::boots;
                machine.since = now;
                machine.arrivals = 0;
                --count;
            }
        }
    }

    void remove(std::size_t count)
    {
        std::vector<std::size_t> running;
        for (std::size_t number = 0; number != machines_.size(); ++number)
            if (machines_[number].state == State::runs)
                running.push_back(number);
        count = std::min(count, running.size() - std::min(running.size(), fleet_.min_machines));
        if (fleet_.removal == Removal::emptiest)
            std::ranges::stable_sort(running, std::greater(),
                                     [&](std::size_t number) { return machines_[number].sessions.size(); });
        for (; count > 0; --count) {
            auto& machine = machines_[running.back()];
            machine.state = machine.sessions.empty() ? State::off : State::drains;
            running.pop_back();
        }
    }

    /// What the name of all machines leads to, as session servers learn it from time to time.
    void list_machines(double now)
    {
        bool has_changed = now == 0;
        std::vector<ServerSpec> specs;
        for (std::size_t number = 0; number != machines_.size(); ++number) {
            auto& machine = machines_[number];
            bool const is_up = machine.state == State::runs || machine.state == State::drains;
            has_changed |= machine.is_listed != is_up;
            machine.is_listed = is_up;
            if (is_up)
                specs.emplace_back(names_[number]);
        }
        if (has_changed)
            for (auto& scheduler : schedulers_)
                scheduler.set_servers(specs);
    }

    void report(double now)
    {
        LoadReport report;
        auto const turn =
            static_cast<std::size_t>(std::fmod(now + 100 * fleet_.report_every, fleet_.report_every));
        for (std::size_t number = turn; number < machines_.size();
             number += static_cast<std::size_t>(fleet_.report_every)) {
            auto const& machine = machines_[number];
            if (!machine.is_listed)
                continue;
            if (machine.state == State::off) {
                for (auto& scheduler : schedulers_)
                    scheduler.mark_unreachable(names_[number], at(now));
                continue;
            }
            double visible = 0;
            int starting = 0;
            for (auto const& [id, session] : machine.sessions) {
                visible += session.visible <= now ? session.load : 0;
                starting += session.visible > now;
            }
            report.load = std::clamp(visible + random_.uniform(-noise, noise), 0.0, 100.0);
            report.sessions = static_cast<int>(machine.sessions.size());
            report.starting = starting;
            report.capacity = fleet_.seats;
            report.draining = machine.state == State::drains;
            report.arrivals = machine.arrivals;
            report.departures = machine.arrivals - *report.sessions;
            report.failed = 0;
            for (auto& scheduler : schedulers_)
                scheduler.report(names_[number], report, at(now));
        }
    }

    void come(double now)
    {
        auto const of_hour = static_cast<std::size_t>(now / hour) % rhythm.size();
        auto const next_hour = (of_hour + 1) % rhythm.size();
        double const passed = std::fmod(now, hour) / hour;
        double const part = rhythm.at(of_hour) * (1 - passed) + rhythm.at(next_hour) * passed;
        double const singles = per_hour_ * part * (1 - fleet_.in_lessons) / hour;
        std::size_t users = poisson(singles);
        if (std::fmod(now, hour) == 0)
            classes_ = poisson(per_hour_ * rhythm.at(of_hour) * fleet_.in_lessons / class_size);
        if (std::fmod(now, hour) < class_window)
            users += poisson(static_cast<double>(classes_) * class_size / class_window);
        double const sigma = fleet_.cost_spread;
        for (; users > 0; --users) {
            ++browsers_;
            double const cost = std::exp(sigma * random_.normal() - sigma * sigma / 2); // mean 1
            Browser const browser{now, cost * fleet_.seat_load, random_.exponential(fleet_.duration)};
            auto const server =
                static_cast<std::size_t>(random_.uniform() * static_cast<double>(schedulers_.size()));
            auto& line = lines_[server];
            if (line.size() >= fleet_.line)
                ++refused_;
            else
                line.push_back(browser);
        }
    }

    std::size_t poisson(double mean)
    {
        if (mean > 1000) // which the normal distribution comes close to
            return static_cast<std::size_t>(std::max(0.0, mean + std::sqrt(mean) * random_.normal()));
        std::size_t count = 0;
        for (double time = random_.exponential(1); time < mean; time += random_.exponential(1))
            ++count;
        return count;
    }

    void serve_line(std::size_t server, double now)
    {
        auto& line = lines_[server];
        while (!line.empty()) {
            auto const placed = schedulers_[server].place(at(now));
            if (!placed)
                return;
            auto const machine = std::stoul(std::string(placed->address));
            events_.push({now + travel, ++last_session_, machine, server, line.front(), true});
            line.pop_front();
        }
    }

    void note_wait(double wait)
    {
        if (wait > 0)
            waits_.push_back(wait);
    }

    void measure(double now)
    {
        if (now < 0)
            return;
        std::size_t on = 0;
        for (auto const& machine : machines_) {
            if (machine.state == State::off)
                continue;
            ++on;
            auto const here = static_cast<double>(machine.sessions.size());
            user_seconds_ += here;
            crammed_seconds_ += machine.wanted > 100 ? here : 0;
        }
        machine_seconds_ += static_cast<double>(on);
        perfect_seconds_ += std::ceil(static_cast<double>(sessions_) / fleet_.seats);
        most_machines_ = std::max(most_machines_, on);
        most_sessions_ = std::max(most_sessions_, sessions_);
    }

    FleetFigures figures()
    {
        FleetFigures figures;
        figures.browsers = browsers_;
        figures.waited = 100 * static_cast<double>(waits_.size()) / browsers_;
        double sum = 0;
        for (double const wait : waits_)
            sum += wait;
        if (!waits_.empty())
            figures.mean_wait = sum / static_cast<double>(waits_.size());
        std::ranges::sort(waits_, std::greater());
        if (auto const late = static_cast<std::size_t>(browsers_ / 1000); late < waits_.size())
            figures.late_wait = waits_[late];
        figures.longest_wait = waits_.empty() ? 0 : waits_.front();
        figures.refused = 100 * refused_ / browsers_;
        figures.crammed = 100 * crammed_seconds_ / user_seconds_;
        figures.machine_hours = machine_seconds_ / hour;
        figures.perfect_machine_hours = perfect_seconds_ / hour;
        figures.most_machines = most_machines_;
        figures.most_sessions = most_sessions_;
        return figures;
    }

    Fleet const& fleet_;
    Randomness random_;
    std::vector<Machine> machines_;
    std::vector<std::string> names_;
    std::vector<Scheduler> schedulers_;
    std::vector<std::deque<Browser>> lines_; ///< At each session server.
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
    double per_hour_ = 0; ///< Browsers, for each unit of `rhythm`.
    double wanted_at_ = 0;
    std::size_t classes_ = 0;
    std::uint64_t last_session_ = 0;
    std::size_t sessions_ = 0;

    double browsers_ = 0;
    double refused_ = 0;
    std::vector<double> waits_;
    double user_seconds_ = 0;
    double crammed_seconds_ = 0;
    double machine_seconds_ = 0;
    double perfect_seconds_ = 0;
    std::size_t most_machines_ = 0;
    std::size_t most_sessions_ = 0;
};

} // namespace

FleetFigures simulate_fleet(Fleet const& fleet, std::uint64_t seed)
{
    return Weekday(fleet, seed).run();
}

} // namespace simulation
