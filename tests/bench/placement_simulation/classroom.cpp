#include "classroom.hpp"

#include "randomness.hpp"
#include "staged.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace simulation {

using namespace webots_cloud;

namespace {

TimePoint at(double time)
{
    // The class begins an hour after the clock did, so that moments before it are no special case.
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(3600 + time)));
}

constexpr char const* world_of_class = "world";

struct MachineState
{
    double base = 0;
    double next_report = 0;
    std::vector<double> placed;
    std::vector<double> arrived;
    std::vector<double> visible; ///< When the load shows each of them.
    std::optional<StagedMachine> staged;
};

class Lesson
{
public:
    Lesson(Classroom const& room, std::uint64_t seed) : room_(room), random_(seed), machines_(room.machines)
    {
        double const first_report = room.unclaimed > 0 ? -room.minute : 0;
        std::vector<ServerSpec> specs;
        for (std::size_t machine = 0; machine != room.machines; ++machine) {
            specs.emplace_back(std::to_string(machine));
            machines_[machine].base = random_.uniform(0, room.max_base_load);
            machines_[machine].next_report =
                first_report + random_.uniform(-2 * room.report_every, -room.report_every);
            if (room.staged > 0)
                machines_[machine].staged.emplace(std::vector<std::string>{world_of_class}, room.staged);
        }
        for (std::size_t server = 0; server != room.session_servers; ++server) {
            SchedulerParams params;
            params.policy = room.policy;
            params.custom = room.custom;
            params.threshold = room.threshold;
            params.session_cost = room.assumed_cost;
            params.seed = seed * 1000 + server;
            schedulers_.emplace_back(Scheduler::make(params).value()).set_servers(specs);
        }
    }

    Seating run()
    {
        std::vector<double> clicks;
        for (int student = 0; student != room_.students; ++student)
            clicks.push_back(random_.uniform(0, room_.minute));
        std::ranges::sort(clicks);
        Seating seating;
        ask_for_nobody(seating);
        for (double const click : clicks) {
            now_ = std::max(now_, click);
            stage_until(now_);
            report_until(now_);
            auto const server =
                static_cast<std::size_t>(random_.uniform() * static_cast<double>(schedulers_.size()));
            if (!send(schedulers_[server]))
                ++seating.refused;
        }
        seating.ready = ready_;
        for (MachineState const& machine : machines_)
            seating.per_machine.push_back(static_cast<int>(machine.placed.size()));
        return seating;
    }

private:
    /// False: there is no machine.
    bool send(Scheduler& scheduler)
    {
        PlacementRequest request;
        if (room_.way == Way::asked)
            now_ = ask_machines(scheduler, request, now_, random_, at,
                                [&](std::string_view name, double asked, double heard) {
                                    scheduler.report(name, look_at(machine(name), asked), at(heard));
                                });
        auto const placement = scheduler.place(request, at(now_));
        if (!placement)
            return false;
        MachineState& chosen = machine(placement->address);
        chosen.placed.push_back(now_);
        chosen.arrived.push_back(room_.way == Way::direct ? now_ + room_.travel : relayed_at(now_, random_));
        bool const is_ready = chosen.staged && chosen.staged->take(world_of_class, true);
        ready_ += is_ready;
        chosen.visible.push_back(is_ready ? chosen.arrived.back() : now_ + room_.visible_after);
        return true;
    }

    MachineState& machine(std::string_view name) { return machines_[std::stoul(std::string(name))]; }

    /// Long enough before the first click for all to be ready.
    void stage_until(double now)
    {
        for (; next_second_ <= now; ++next_second_)
            for (MachineState& machine : machines_) {
                if (!machine.staged)
                    continue;
                int const here = until(machine.arrived, next_second_);
                int const running = until(machine.visible, next_second_);
                double const load = machine.base + room_.session_load * running;
                machine.staged->live(next_second_, room_.seats, here, load, running < here);
            }
    }

    void ask_for_nobody(Seating& seating)
    {
        std::vector<double> requests;
        for (int request = 0; request != room_.unclaimed; ++request)
            requests.push_back(random_.uniform(-room_.minute, 0));
        std::ranges::sort(requests);
        for (double const request : requests) {
            report_until(request);
            seating.refused += schedulers_.front().place(at(request)).has_error();
        }
    }

    void report_until(double now)
    {
        for (;;) {
            auto const next = std::ranges::min_element(machines_, {}, &MachineState::next_report);
            if (next->next_report > now)
                return;
            auto const name = std::to_string(next - machines_.begin());
            LoadReport const report = look_at(*next, next->next_report);
            for (Scheduler& scheduler : schedulers_)
                scheduler.report(name, report, at(next->next_report));
            next->next_report += room_.report_every;
        }
    }

    static int until(std::vector<double> const& moments, double now)
    {
        return static_cast<int>(std::ranges::count_if(moments, [=](double when) { return when <= now; }));
    }

    LoadReport look_at(MachineState const& machine, double now)
    {
        double sum = 0;
        for (int sample = 0; sample != room_.samples; ++sample) {
            int const running = until(machine.visible, now - sample);
            double const noise = random_.uniform(-room_.noise, room_.noise);
            sum += std::clamp(machine.base + room_.session_load * running + noise, 0.0, 100.0);
        }
        LoadReport report(sum / room_.samples);
        if (room_.counted) {
            report.sessions = until(machine.arrived, now);
            report.starting = *report.sessions - std::min(*report.sessions, until(machine.visible, now));
            if (room_.capacity > 0)
                report.capacity = room_.capacity;
            if (room_.arrivals) {
                report.arrivals = *report.sessions;
                report.failed = report.departures = 0;
            }
        }
        return report;
    }

    Classroom const& room_;
    double now_ = -room_.minute;
    double next_second_ = -300;
    int ready_ = 0;
    Randomness random_;
    std::vector<MachineState> machines_;
    std::vector<Scheduler> schedulers_;
};

} // namespace

Seating seat(Classroom const& room, std::uint64_t seed)
{
    return Lesson(room, seed).run();
}

ClassroomFigures average_classroom(Classroom const& room, std::uint64_t seeds)
{
    ClassroomFigures figures;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        Seating const seating = seat(room, seed);
        figures.worst += *std::ranges::max_element(seating.per_machine);
        for (int const sessions : seating.per_machine)
            figures.crammed += sessions > room.seats ? sessions : 0;
        figures.refused += seating.refused;
        figures.ready += seating.ready;
    }
    auto const count = static_cast<double>(seeds);
    figures.worst /= count;
    figures.crammed /= count;
    figures.refused /= count;
    figures.ready /= count;
    return figures;
}

} // namespace simulation
