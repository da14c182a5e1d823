// How often the wait was within the range that WaitEstimate had given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace simulation {

class Randomness;

/// A room where every seat that comes free is taken at once.
struct Sessions
{
    std::size_t seats = 20;
    std::function<double(Randomness&)> length; ///< Seconds.
    double begin_within = 0;                   ///< The first sessions begin at random moments within so long.
    std::size_t departures = 20;               ///< So many have been seen when somebody asks,
    double asked_within = 0;                   ///< and so long later at most, at a random moment; seconds.
    std::size_t ahead = 0;
    std::size_t trials = 4000;
    std::uint64_t seed = 1;
};

/// In percent of the trials.
struct Coverage
{
    double within = 0;
    double shorter = 0;
    double longer = 0;
    double within_rounded = 0; ///< In the range that is said.
    double median_ratio = 0;   ///< Of `most` to `least`.
};

Coverage coverage(Sessions const& sessions);

} // namespace simulation
