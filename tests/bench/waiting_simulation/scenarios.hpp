// What is simulated, for the tables and for the test.
#pragma once

#include "coverage.hpp"
#include "randomness.hpp"
#include "site.hpp"

#include <chrono>
#include <cmath>

namespace simulation {

enum class Rule
{
    first_come, ///< Without any penalty, and one group may take every place.
    ours,
    half_an_hour ///< Ours, with a penalty of 30 minutes at most.
};

inline Site under(Rule rule, Site site)
{
    if (rule == Rule::first_come) {
        site.room.seat_penalty = {};
        site.room.places *= 4;
    }
    if (rule == Rule::half_an_hour)
        site.room.max_penalty = std::chrono::minutes(30);
    return site;
}

/// Singles alone, who need nine of ten seats.
inline Site quiet_site(std::uint64_t seed)
{
    Site site;
    site.seed = seed;
    return site;
}

/// One address sends 200 at once, an hour after the warm-up.
inline Site flooded_site(std::uint64_t seed)
{
    auto site = quiet_site(seed);
    site.crowds.push_back({"crowd", 200, site.warm_up + 3600, 0, 0});
    return site;
}

/// One address always has as many browsers that want a seat or have one, and singles need half of the seats.
inline Site site_with_hog(std::uint64_t seed, std::size_t browsers)
{
    auto site = quiet_site(seed);
    site.singles = 0.5 / 12;
    site.crowds.push_back({"crowd", browsers, 0, 60, 1});
    return site;
}

/// A class of 30 behind one address clicks within 30 s.
inline Site site_with_class(std::uint64_t seed)
{
    auto site = quiet_site(seed);
    site.crowds.push_back({"crowd", 30, site.warm_up + 3600, 30, 0});
    return site;
}

/// 56 addresses of which 40 have one browser, 15 have 4, and one has 40, all of which come again at once: 140
/// for 50 seats.
inline Site overloaded_site(std::uint64_t seed)
{
    auto site = quiet_site(seed);
    site.singles = 0;
    for (int address = 0; address != 56; ++address) {
        std::size_t const browsers = address < 40 ? 1 : address < 55 ? 4 : 40;
        site.crowds.push_back({"address " + std::to_string(address), browsers, 0, 60, 1});
    }
    return site;
}

/// More singles than the site can ever serve: the room is full all the time.
inline Site hopeless_site(std::uint64_t seed)
{
    auto site = quiet_site(seed);
    site.singles = 1.5 / 12;
    site.room.places = 100;
    site.warm_up = 3 * 3600;
    return site;
}

inline std::function<double(Randomness&)> exponential_length(double mean)
{
    return [mean](Randomness& random) { return random.exponential(mean); };
}

/// `spread` is the standard deviation of the logarithm.
inline std::function<double(Randomness&)> log_normal_length(double mean, double spread)
{
    return [mean, spread](Randomness& random) {
        return mean * std::exp(spread * random.normal() - spread * spread / 2);
    };
}

/// All alike, to a minute.
inline std::function<double(Randomness&)> lesson_length(double length)
{
    return [length](Randomness& random) { return random.uniform(length - 30, length + 30); };
}

} // namespace simulation
