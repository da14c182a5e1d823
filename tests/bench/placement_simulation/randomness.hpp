// Random variates of our own: those of the standard library differ between implementations, tables must not.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace simulation {

class Randomness
{
public:
    explicit Randomness(std::uint64_t seed) : engine_(seed) {}

    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    double exponential(double mean) { return -mean * std::log1p(-uniform()); }
    double normal()
    {
        double const radius = std::sqrt(-2 * std::log1p(-uniform()));
        return radius * std::cos(2 * std::numbers::pi * uniform());
    }
    bool chance(double probability) { return uniform() < probability; }

private:
    std::mt19937_64 engine_;
};

} // namespace simulation
