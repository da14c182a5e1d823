#include "site.hpp"

#include "randomness.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>

namespace simulation {
namespace {

using webots_cloud::WallTime;
using webots_cloud::core::WaitingRoom;

constexpr std::size_t single = std::numeric_limits<std::size_t>::max();

WallTime moment(double seconds)
{
    return WallTime(std::chrono::nanoseconds(std::llround(seconds * 1e9)));
}

double seconds_of(WallTime time)
{
    return std::chrono::duration<double>(time.time_since_epoch()).count();
}

struct Event
{
    double at;
    std::uint64_t number; // of equal times, the first that was made
    bool is_arrival;
    std::size_t crowd;
    double sat_down; // of a departure

    bool operator>(Event const& other) const
    {
        return std::tie(at, number) > std::tie(other.at, other.number);
    }
};

class Run
{
public:
    explicit Run(Site const& site)
        : site_(site), arrivals_(site.seed), lengths_(site.seed + 1'000'000), room_(site.room)
    {}

    Day operator()()
    {
        next_single(0);
        for (std::size_t crowd = 0; crowd != site_.crowds.size(); ++crowd) {
            auto const& one = site_.crowds[crowd];
            for (std::size_t browser = 0; browser != one.browsers; ++browser)
                add(one.begins +
                        one.within * static_cast<double>(browser) / static_cast<double>(one.browsers),
                    true, crowd);
        }
        while (!events_.empty() && events_.top().at < site_.warm_up + site_.lasts) {
            auto const event = events_.top();
            events_.pop();
            if (event.is_arrival)
                arrive(event);
            else
                depart(event);
        }
        return std::move(day_);
    }

private:
    struct Waiting : WaitingRoom::Customer
    {
        Waiting(WaitingRoom::Id number, Visit its_visit, std::size_t its_crowd)
            : Customer(number), visit(std::move(its_visit)), crowd(its_crowd)
        {}

        Visit visit;
        std::size_t crowd;
    };

    void add(double at, bool is_arrival, std::size_t crowd, double sat_down = 0)
    {
        events_.push({at, events_made_++, is_arrival, crowd, sat_down});
    }

    void next_single(double after)
    {
        if (site_.singles > 0)
            add(after + arrivals_.exponential(1 / site_.singles), true, single);
    }

    void arrive(Event const& event)
    {
        bool const is_single = event.crowd == single;
        if (is_single)
            next_single(event.at);
        auto const id = ++ids_;
        auto const name = is_single ? std::string() : site_.crowds[event.crowd].group;
        auto const address = is_single ? "single " + std::to_string(id) : name;
        auto const held = is_single ? 0 : held_[name];
        Visit visit{name, held + room_.size_of(address) + 1, event.at, event.at, 0};
        if (busy_ < site_.seats && room_.size() == 0)
            return sit_down(std::move(visit), event.crowd, event.at);
        auto& waiting = waiting_.try_emplace(id, id, std::move(visit), event.crowd).first->second;
        waiting.group = address;
        waiting.rank = moment(event.at);
        if (room_.enter(waiting, held) == WaitingRoom::Verdict::waits) {
            waiting.visit.rank = seconds_of(waiting.rank);
            return;
        }
        waiting_.erase(id);
        if (event.at >= site_.warm_up)
            ++(is_single ? day_.refused : day_.crowd_refused);
        come_again(event.crowd, event.at);
    }

    void sit_down(Visit visit, std::size_t crowd, double at)
    {
        ++busy_;
        if (crowd != single)
            ++held_[visit.group];
        add(at + lengths_.exponential(site_.session), false, crowd, at);
        visit.served = at;
        if (visit.arrived >= site_.warm_up)
            day_.visits.push_back(std::move(visit));
    }

    void depart(Event const& event)
    {
        --busy_;
        if (event.crowd != single) {
            auto const& group = site_.crowds[event.crowd].group;
            --held_[group];
            day_.seat_time[group] += std::max(0.0, event.at - std::max(event.sat_down, site_.warm_up));
            come_again(event.crowd, event.at);
        }
        if (room_.size() > 0) {
            auto& first = static_cast<Waiting&>(room_.at(0));
            room_.leave(first);
            sit_down(std::move(first.visit), first.crowd, event.at);
            auto const id = first.id; // not a reference into what is erased
            waiting_.erase(id);
        }
    }

    void come_again(std::size_t crowd, double at)
    {
        if (crowd != single && site_.crowds[crowd].again_after > 0)
            add(at + site_.crowds[crowd].again_after, true, crowd);
    }

    Site const& site_;
    Randomness arrivals_;
    Randomness lengths_;
    WaitingRoom room_;
    std::map<WaitingRoom::Id, Waiting> waiting_;
    std::map<std::string, std::size_t> held_;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
    std::uint64_t events_made_ = 0;
    WaitingRoom::Id ids_ = 0;
    std::size_t busy_ = 0;
    Day day_;
};

} // namespace

Day simulate(Site const& site)
{
    return Run(site)();
}

std::vector<double> waits(Day const& day, std::string const& group)
{
    std::vector<double> found;
    for (auto const& visit : day.visits) {
        if (visit.group == group)
            found.push_back(visit.served - visit.arrived);
    }
    return found;
}

double longest_lead(Day const& day)
{
    double lead = 0;
    double earliest = std::numeric_limits<double>::max(); // of those who were served later
    for (auto visit = day.visits.rbegin(); visit != day.visits.rend(); ++visit) {
        lead = std::max(lead, visit->arrived - earliest);
        earliest = std::min(earliest, visit->arrived);
    }
    return lead;
}

double jain_index(std::vector<double> const& shares)
{
    double sum = 0;
    double squares = 0;
    for (double const share : shares) {
        sum += share;
        squares += share * share;
    }
    return sum * sum / (static_cast<double>(shares.size()) * squares);
}

double quantile(std::vector<double> values, double share)
{
    if (values.empty())
        return 0;
    auto const position = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(position), values.end());
    return values[position];
}

} // namespace simulation
