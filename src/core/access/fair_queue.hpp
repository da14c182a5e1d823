// Whose turn it is next where clients ask for more than can be done at once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

namespace webots_cloud::core {

/// Clients take turns, however many things each of them asks for: start-time fair queueing (P. Goyal,
/// H. M. Vin, H. Cheng, SIGCOMM 1996) with things that all take one turn. A client that asks for little goes
/// before all that always have something waiting: it is up to `credit` turns ahead of them.
///
/// Memory: the things that wait, and a number for each client, of at most 65,536 (then all begin anew) and
/// only as long as something waits.
template<class Thing>
class FairQueue
{
public:
    void push(std::string const& client, Thing thing)
    {
        if (next_turns_.size() >= max_clients)
            next_turns_.clear();
        auto& next = next_turns_.try_emplace(client, 0).first->second;
        next = std::max(next, now_ + 1);
        waiting_.emplace(next, std::move(thing));
        ++next;
    }

    /// The next thing; none: nothing waits.
    std::optional<Thing> pop()
    {
        if (waiting_.empty())
            return {};
        auto const first = waiting_.begin();
        now_ = std::max(now_, first->first > credit ? first->first - credit : 0);
        std::optional<Thing> thing(std::move(first->second));
        waiting_.erase(first);
        if (waiting_.empty()) {
            next_turns_.clear();
            now_ = 0;
        }
        return thing;
    }

    std::size_t size() const noexcept { return waiting_.size(); }

private:
    using Turn = std::uint64_t; // of a client that always has something waiting

    static constexpr Turn credit = 8;
    static constexpr std::size_t max_clients = 65'536;

    std::multimap<Turn, Thing> waiting_; // of equal ones the first that came
    std::unordered_map<std::string, Turn> next_turns_;
    Turn now_ = 0; ///< That of a client that comes now, less one.
};

} // namespace webots_cloud::core
