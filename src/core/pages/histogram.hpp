// How often something took how long, for /metrics.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <vector>

namespace webots_cloud::core {

/// A histogram of Prometheus: counts of values up to each bound, and of all.
class Histogram
{
public:
    /// `bounds`: ascending.
    Histogram(std::initializer_list<double> bounds) : bounds_(bounds), counts_(bounds.size() + 1) {}

    void add(double value) noexcept
    {
        std::size_t bucket = 0;
        while (bucket < bounds_.size() && value > bounds_[bucket])
            ++bucket;
        ++counts_[bucket];
        sum_ += value;
    }

    std::vector<double> const& bounds() const noexcept { return bounds_; }
    /// One for each bound, of values above the one before, and one for those above all.
    std::vector<std::uint64_t> const& counts() const noexcept { return counts_; }
    double sum() const noexcept { return sum_; }
    std::uint64_t count() const noexcept
    {
        return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{});
    }

private:
    std::vector<double> bounds_;
    std::vector<std::uint64_t> counts_;
    double sum_ = 0;
};

} // namespace webots_cloud::core
