#include "campus.hpp"

#include "randomness.hpp"
#include "staged.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <list>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

namespace simulation {

using namespace webots_cloud;

namespace {

constexpr double travel = 1;         // s until a browser arrives at its machine
constexpr double visible_after = 20; // s until its load shows
constexpr double report_every = 5;   // s
constexpr double noise = 2;          // percent, of one sample, either way
constexpr std::size_t samples = 5;
constexpr double class_window = 30; // s

TimePoint at(double time)
{
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(3600 + time)));
}

constexpr double use_noise = 0.1; // of what a world's sessions are seen to use, relatively, either way

struct Session
{
    std::size_t world;
    double load; ///< Percent of its machine.
    double arrives;
    double visible;
    double ends;
};

/// Somebody who asks for a session.
struct Visitor
{
    double came;
    std::size_t session_server;
    double cost; ///< Of the session, relative to the average one.
    std::size_t world;
    bool comes; ///< To the machine, once placed.
    double stays;
    bool wants_room = false; ///< It waits, although machines are free.
};

struct MachineState
{
    double percent_per_cost = 0;
    int seats = 0;
    double base = 0;
    double phase = 0;
    double changes_at = 0; ///< When it dies, or is back.
    bool alive = true;
    std::vector<Session> sessions;
    std::size_t departed = 0; ///< Since it came up.
    std::array<double, samples> recent{};
    std::vector<std::uint32_t> cache; ///< Projects; the one used last is the first.
    std::optional<StagedMachine> staged;
    double staging = 0; ///< Percent, of the simulations that are being staged: reports leave it out.

    double wanted() const
    {
        return std::accumulate(sessions.begin(), sessions.end(), base + staging,
                               [](double sum, Session const& session) { return sum + session.load; });
    }
    double visible(double now) const
    {
        return std::accumulate(sessions.begin(), sessions.end(), base,
                               [now](double sum, Session const& session) {
                                   return sum + (session.visible <= now ? session.load : 0);
                               });
    }
};

class Day
{
public:
    Day(Campus const& campus, std::uint64_t seed)
        : campus_(campus), random_(seed), world_random_(seed + 1'000'000), travel_random_(seed + 2'000'000),
          machines_(campus.seats.size())
    {
        choose_worlds();
        std::vector<ServerSpec> specs;
        for (std::size_t machine = 0; machine != machines_.size(); ++machine) {
            specs.emplace_back(std::to_string(machine));
            machines_[machine].seats = campus.seats[machine];
            machines_[machine].percent_per_cost = campus.seat_load * 8 / campus.seats[machine];
            machines_[machine].base = random_.uniform(0, 10);
            machines_[machine].phase = std::floor(random_.uniform(0, report_every));
            machines_[machine].changes_at =
                campus.mean_life > 0 ? random_.exponential(campus.mean_life) : 1e18;
            if (campus.staged_worlds > 0)
                machines_[machine].staged.emplace(most_popular(campus.staged_worlds), campus.staged_of_each);
        }
        for (std::size_t server = 0; server != campus.session_servers; ++server) {
            SchedulerParams params = campus.params;
            params.policy = campus.policy;
            params.custom = campus.custom;
            params.seed = seed * 1000 + server;
            schedulers_.emplace_back(Scheduler::make(params).value()).set_servers(specs);
            if (campus.others_known)
                show_others(schedulers_.back());
        }
    }

    CampusFigures run()
    {
        double const total = std::accumulate(campus_.seats.begin(), campus_.seats.end(), 0.0);
        users_per_second_ = campus_.utilisation * total / campus_.duration;
        // Who never arrives takes no seat: clicks come so much more often that those who do fill the same
        // part.
        users_per_second_ /= 1 - campus_.no_show;
        for (double now = -2 * report_every; now < campus_.warm_up + campus_.length; ++now) {
            live(now);
            report(now);
            serve_line(now);
            if (now >= 0)
                click(now);
            if (now >= campus_.warm_up)
                measure();
        }
        return figures();
    }

private:
    /// Somebody has come whom this scheduler has not placed, half an hour before.
    void show_others(Scheduler& scheduler)
    {
        for (int const sessions : {0, 1}) {
            LoadReport report(machines_.front().base);
            report.sessions = sessions;
            report.starting = 0;
            scheduler.report("0", report, at(-1800 + report_every * sessions));
        }
    }

    void live(double now)
    {
        for (MachineState& machine : machines_) {
            machine.departed += std::erase_if(machine.sessions,
                                              [now](Session const& session) { return session.ends <= now; });
            if (machine.changes_at <= now) {
                machine.alive = !machine.alive;
                machine.changes_at =
                    now + (machine.alive ? random_.exponential(campus_.mean_life) : campus_.repair);
                clicks_again_ += machine.sessions.size();
                machine.sessions.clear();
                machine.departed = 0;
                machine.recent.fill(machine.base);
                if (machine.staged)
                    machine.staged->die();
            }
            stage(machine, now);
            std::shift_right(machine.recent.begin(), machine.recent.end(), 1);
            double const sample = machine.visible(now) + random_.uniform(-noise, noise);
            machine.recent.front() = std::clamp(sample, 0.0, 100.0);
        }
    }

    void stage(MachineState& machine, double now)
    {
        if (!machine.staged || !machine.alive)
            return;
        double const load = std::accumulate(machine.recent.begin(), machine.recent.end(), 0.0) / samples;
        bool const starts = std::ranges::any_of(
            machine.sessions, [now](Session const& session) { return session.visible > now; });
        machine.staged->live(now, machine.seats, static_cast<int>(machine.sessions.size()), load, starts);
        machine.staging = machine.staged->starting(now) * machine.percent_per_cost;
    }

    /// Their addresses.
    std::vector<std::string> most_popular(std::size_t count) const
    {
        std::vector<std::size_t> worlds(popularity_.size());
        std::iota(worlds.begin(), worlds.end(), 0);
        auto const part = [this](std::size_t world) {
            return popularity_[world] - (world == 0 ? 0 : popularity_[world - 1]);
        };
        std::ranges::sort(worlds, std::greater(), part);
        std::vector<std::string> addresses;
        for (std::size_t rank = 0; rank != std::min(count, worlds.size()); ++rank)
            addresses.push_back(address_of(worlds[rank]));
        return addresses;
    }

    void report(double now)
    {
        for (std::size_t number = 0; number != machines_.size(); ++number) {
            MachineState const& machine = machines_[number];
            if (std::fmod(now + 100 * report_every, report_every) != machine.phase)
                continue;
            for (Scheduler& scheduler : schedulers_) {
                if (machine.alive)
                    scheduler.report(std::to_string(number), look_at(machine, now), at(std::max(now, now_)));
                else
                    scheduler.mark_unreachable(std::to_string(number), at(std::max(now, now_)));
            }
        }
    }

    /// Worlds by cost, each with its popularity: a few are started often, most are rare.
    void choose_worlds()
    {
        std::vector<std::size_t> ranks(static_cast<std::size_t>(campus_.worlds));
        std::iota(ranks.begin(), ranks.end(), 1);
        for (std::size_t last = ranks.size(); last > 1; --last)
            std::swap(ranks[last - 1],
                      ranks[static_cast<std::size_t>(world_random_.uniform() * static_cast<double>(last))]);
        double sum = 0;
        for (std::size_t const rank : ranks)
            popularity_.push_back(sum += 1 / static_cast<double>(rank));
        for (double& part : popularity_)
            part /= sum;
    }

    /// The world of a session whose cost has the normal variate `z`: sessions of one world differ by
    /// `same_world`.
    std::size_t world_of(double z)
    {
        if (campus_.new_worlds)
            return ++new_worlds_;
        double const within = campus_.same_world / campus_.cost_spread;
        double const of_world = std::sqrt(1 - within * within) * z + within * world_random_.normal();
        double const quantile = std::erfc(-of_world / std::numbers::sqrt2) / 2;
        auto const found = std::ranges::lower_bound(popularity_, quantile);
        return static_cast<std::size_t>(std::min(found, popularity_.end() - 1) - popularity_.begin());
    }

    std::string address_of(std::size_t world) const
    {
        auto const repository = world / static_cast<std::size_t>(campus_.worlds_per_repository);
        return "https://github.com/o/r" + std::to_string(repository) + "/blob/main/worlds/w" +
               std::to_string(world) + ".wbt";
    }

    void report_worlds(MachineState const& machine, double now, LoadReport& report)
    {
        double const crowded = std::max(1.0, machine.visible(now) / 100);
        report.processors = 100 / machine.percent_per_cost; // an average session keeps one busy
        std::map<std::size_t, WorldUse> uses;
        for (Session const& session : machine.sessions) {
            if (session.arrives > now)
                continue;
            WorldUse& use = uses[session.world];
            bool const runs = session.visible <= now;
            ++(runs ? use.running : use.starting);
            if (runs)
                use.processors += session.load / machine.percent_per_cost / crowded;
        }
        for (auto& [world, use] : uses) {
            use.key = world_key(address_of(world), "mjpeg");
            use.processors *= 1 + world_random_.uniform(-use_noise, use_noise);
            report.worlds.push_back(use);
        }
        auto const sessions = [](WorldUse const& use) { return use.running + use.starting; };
        std::ranges::stable_sort(report.worlds, std::greater(), sessions);
        if (report.worlds.size() > LoadReport::max_worlds)
            report.worlds.resize(LoadReport::max_worlds);
    }

    LoadReport look_at(MachineState const& machine, double now)
    {
        LoadReport report(std::accumulate(machine.recent.begin(), machine.recent.end(), 0.0) / samples);
        if (campus_.peers == Peers::bare)
            return report;
        auto const counts = [&](auto moment) {
            return static_cast<int>(
                std::ranges::count_if(machine.sessions, [=](Session const& s) { return s.*moment <= now; }));
        };
        report.sessions = counts(&Session::arrives);
        report.starting = *report.sessions - counts(&Session::visible);
        if (campus_.reports_projects)
            report.projects = machine.cache;
        if (campus_.peers == Peers::seated)
            report.capacity = machine.seats;
        if (campus_.peers == Peers::worlds)
            report_worlds(machine, now, report);
        if (campus_.peers == Peers::exact || campus_.peers == Peers::worlds) {
            report.departures = static_cast<std::int64_t>(machine.departed);
            report.arrivals = *report.departures + *report.sessions;
            report.failed = 0;
        }
        return report;
    }

    void click(double now)
    {
        std::size_t users = std::exchange(clicks_again_, 0);
        users += poisson(users_per_second_ * (1 - campus_.in_classes));
        if (random_.chance(users_per_second_ * campus_.in_classes / campus_.class_size))
            class_ends_.push_back(now + class_window);
        std::erase_if(class_ends_, [now](double end) { return end <= now; });
        for (std::size_t room = 0; room != class_ends_.size(); ++room)
            users += poisson(campus_.class_size / class_window);
        for (std::size_t user = 0; user != users; ++user)
            seat_user(now + static_cast<double>(user) / static_cast<double>(users));
    }

    std::size_t poisson(double mean)
    {
        std::size_t count = 0;
        for (double time = random_.exponential(1); time < mean; time += random_.exponential(1))
            ++count;
        return count;
    }

    void seat_user(double now)
    {
        double const sigma = campus_.cost_spread;
        double const z = random_.normal();
        Visitor visitor;
        visitor.came = now;
        visitor.cost = std::exp(sigma * z - sigma * sigma / 2); // mean 1
        visitor.world = world_of(z);
        visitor.comes = !random_.chance(campus_.no_show);
        visitor.stays = random_.exponential(campus_.duration);
        // The oracle draws it as well, so that it sees the same day.
        visitor.session_server =
            static_cast<std::size_t>(random_.uniform() * static_cast<double>(schedulers_.size()));
        users_ += is_measured(visitor);
        bool const may_pass = std::ranges::all_of(line_, [&visitor](Visitor const& other) {
            return other.wants_room && other.world != visitor.world;
        });
        if (may_pass && seat(visitor, now))
            return;
        if (campus_.waiting_room)
            line_.push_back(visitor);
        else
            refused_ += is_measured(visitor);
    }

    bool is_measured(Visitor const& visitor) const { return visitor.came >= campus_.warm_up; }

    /// False: no machine takes it.
    bool seat(Visitor& visitor, double now)
    {
        std::optional<std::size_t> const choice =
            campus_.knowledge == Knowledge::reports ? ask(visitor, now) : divine(visitor.cost);
        if (!choice)
            return false;
        MachineState& machine = machines_[*choice];
        if (!machine.alive) {
            stranded_ += is_measured(visitor);
        } else if (visitor.comes) {
            if (campus_.cached_projects != 0) {
                bool const is_warm = fetch(machine, project_key(address_of(visitor.world)));
                warm_ += is_measured(visitor) && is_warm;
            }
            arrived_ += is_measured(visitor);
            double const arrives =
                campus_.way == Way::direct ? now + travel : relayed_at(now_, travel_random_);
            bool const is_ready = machine.staged && machine.staged->take(address_of(visitor.world), false);
            ready_ += is_measured(visitor) && is_ready;
            machine.sessions.push_back({visitor.world, visitor.cost * machine.percent_per_cost, arrives,
                                        is_ready && !campus_.staged_show_late ? arrives : now + visible_after,
                                        now + visible_after + visitor.stays});
        }
        return true;
    }

    /// While somebody waits, a session server asks machines for reports once a second.
    void serve_line(double now)
    {
        if (line_.empty())
            return;
        now_ = std::max(now_, now);
        for (std::size_t number = 0; number != machines_.size(); ++number)
            if (machines_[number].alive)
                for (Scheduler& scheduler : schedulers_)
                    scheduler.report(std::to_string(number), look_at(machines_[number], now), at(now_));
        for (auto visitor = line_.begin(); visitor != line_.end();) {
            if (seat(*visitor, now)) {
                note_wait(*visitor, now);
                visitor = line_.erase(visitor);
            } else if (visitor->wants_room) {
                ++visitor;
            } else {
                break;
            }
        }
    }

    void note_wait(Visitor const& visitor, double now)
    {
        if (!is_measured(visitor))
            return;
        double const waited = now - visitor.came;
        ++waited_;
        waited_seconds_ += waited;
        longest_wait_ = std::max(longest_wait_, waited);
    }

    /// False when it was not in the cache.
    bool fetch(MachineState& machine, std::uint32_t project) const
    {
        bool const is_there = std::erase(machine.cache, project) != 0;
        machine.cache.insert(machine.cache.begin(), project);
        machine.cache.resize(std::min(machine.cache.size(), campus_.cached_projects));
        return is_there;
    }

    std::optional<std::size_t> ask(Visitor& visitor, double now)
    {
        PlacementRequest request;
        request.only_free = campus_.waiting_room;
        request.must_fit = campus_.waiting_room && now - visitor.came < campus_.wait_for_room;
        if (campus_.peers == Peers::worlds) {
            request.world = address_of(visitor.world);
            request.mode = "mjpeg";
        }
        Scheduler& scheduler = schedulers_[visitor.session_server];
        now_ = std::max(now_, now);
        if (campus_.way == Way::asked)
            now_ = ask_machines(scheduler, request, now_, travel_random_, at,
                                [&](std::string_view name, double asked, double heard) {
                                    MachineState const& machine = machines_[std::stoul(std::string(name))];
                                    if (machine.alive)
                                        scheduler.report(name, look_at(machine, asked), at(heard));
                                });
        auto const placement = scheduler.place(request, at(now_));
        visitor.wants_room = !placement && placement.error() == errc::too_large;
        if (!placement)
            return std::nullopt;
        return std::stoul(std::string(placement->address));
    }

    std::optional<std::size_t> divine(double cost) const
    {
        double const assumed = campus_.knowledge == Knowledge::everything ? cost : 1;
        std::optional<std::size_t> best;
        double least = 1e18;
        for (std::size_t number = 0; number != machines_.size(); ++number) {
            MachineState const& machine = machines_[number];
            double const wanted = machine.wanted();
            double const after = wanted + assumed * machine.percent_per_cost;
            if (machine.alive && wanted < campus_.params.threshold && after < least) {
                least = after;
                best = number;
            }
        }
        return best;
    }

    void measure()
    {
        double sum = 0;
        double squares = 0;
        for (MachineState const& machine : machines_) {
            double const wanted = machine.wanted();
            auto const here = static_cast<double>(machine.sessions.size());
            user_seconds_ += here;
            crammed_seconds_ += wanted > 100 ? here : 0;
            slow_seconds_ += here * std::max(1.0, wanted / 100);
            sum += wanted;
            squares += wanted * wanted;
        }
        auto const count = static_cast<double>(machines_.size());
        spread_ += std::sqrt(std::max(0.0, squares / count - sum / count * sum / count));
        ++moments_;
    }

    CampusFigures figures() const
    {
        CampusFigures figures;
        figures.crammed = 100 * crammed_seconds_ / user_seconds_;
        figures.slowdown = slow_seconds_ / user_seconds_;
        figures.refused = 100 * refused_ / users_;
        figures.waited = 100 * waited_ / users_;
        figures.wait = waited_ > 0 ? waited_seconds_ / waited_ : 0;
        figures.longest_wait = longest_wait_;
        figures.stranded = 100 * stranded_ / users_;
        figures.warm = arrived_ > 0 ? 100 * warm_ / arrived_ : 0;
        figures.ready = arrived_ > 0 ? 100 * ready_ / arrived_ : 0;
        figures.unevenness = spread_ / moments_;
        return figures;
    }

    Campus const& campus_;
    Randomness random_;
    Randomness
        world_random_; ///< Its own, so that the costs of sessions are the same with and without worlds.
    Randomness travel_random_;
    std::vector<double> popularity_; ///< Of the worlds, by cost: sums.
    std::size_t new_worlds_ = 1'000'000;
    std::vector<MachineState> machines_;
    std::vector<Scheduler> schedulers_;
    double now_ = -1e9; ///< Of the schedulers: questions take time.
    double users_per_second_ = 0;
    std::size_t clicks_again_ = 0; ///< Users of a machine that died.
    std::vector<double> class_ends_;
    std::list<Visitor> line_;

    double users_ = 0;
    double refused_ = 0;
    double waited_ = 0;
    double waited_seconds_ = 0;
    double longest_wait_ = 0;
    double stranded_ = 0;
    double arrived_ = 0;
    double warm_ = 0;
    double ready_ = 0;
    double user_seconds_ = 0;
    double crammed_seconds_ = 0;
    double slow_seconds_ = 0;
    double spread_ = 0;
    double moments_ = 0;
};

} // namespace

CampusFigures simulate_campus(Campus const& campus, std::uint64_t seed)
{
    return Day(campus, seed).run();
}

CampusFigures average_campus(Campus const& campus, std::uint64_t seeds)
{
    CampusFigures mean;
    auto const count = static_cast<double>(seeds);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        CampusFigures const day = simulate_campus(campus, seed);
        mean.crammed += day.crammed / count;
        mean.slowdown += day.slowdown / count;
        mean.refused += day.refused / count;
        mean.waited += day.waited / count;
        mean.wait += day.wait / count;
        mean.longest_wait = std::max(mean.longest_wait, day.longest_wait);
        mean.stranded += day.stranded / count;
        mean.warm += day.warm / count;
        mean.ready += day.ready / count;
        mean.unevenness += day.unevenness / count;
    }
    return mean;
}

} // namespace simulation
