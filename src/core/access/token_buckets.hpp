// Limits the rate of each client's requests.
#pragma once

#include "quota_levels.hpp"

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// A token bucket for each client, by its quota key: a burst of requests, and a rate per second in the
/// long run. Each wider network of a client (`QuotaLevels`) has one, too, with as much more as its factor
/// says.
///
/// Bounded: when there are too many buckets, full ones are dropped, which loses nothing, and then those that
/// would be full soonest. No client is refused because the table is full; an attacker with very many
/// addresses gains a few requests.
class TokenBuckets
{
public:
    TokenBuckets() = default; ///< Refuses nobody.

    /// Either 0: refuses nobody.
    TokenBuckets(std::size_t burst, double a_second, std::size_t max_clients = 10'000)
        : max_clients_(std::max<std::size_t>(1, max_clients))
    {
        if (burst == 0 || a_second <= 0)
            return;
        interval_ = std::max(
            Duration(1), std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / a_second)));
        capacity_ = interval_ * static_cast<Duration::rep>(burst);
    }

    enum class Verdict
    {
        taken,
        refused_first, ///< The first refusal since the bucket (`refused_by`) was full: worth a line in the
                       ///< log.
        refused
    };

    /// Takes a token. The empty key belongs to no client and is not counted.
    Verdict take(std::string_view key, TimePoint now)
    {
        if (key.empty() || capacity_ == Duration::zero())
            return Verdict::taken;
        if (QuotaLevels::may_have_more(key))
            return take_at_each_level(key, now);
        if (buckets_.size() >= max_clients_ && buckets_.find(key) == buckets_.end())
            make_room(now);
        auto& bucket = bucket_of(key, now);
        if (bucket.full_at + interval_ - now > capacity_)
            return refuse(key, bucket);
        bucket.full_at += interval_;
        return Verdict::taken;
    }

    /// Whose bucket was empty at the last refusal: the client's key, or the name of a wider network.
    std::string const& refused_by() const noexcept { return refused_by_; }

    /// Whether `take` would take one.
    bool has_token(std::string_view key, TimePoint now) const
    {
        if (key.empty() || capacity_ == Duration::zero())
            return true;
        QuotaLevels const levels(key);
        return std::all_of(levels.begin(), levels.end(), [this, now](QuotaLevel const& level) {
            auto const found = buckets_.find(level.key);
            return found == buckets_.end() ||
                   std::max(found->second.full_at, now) + interval_of(level) - now <= capacity_;
        });
    }

    /// How long at most a client that was refused waits for its next token.
    Duration interval() const noexcept { return interval_; }

    std::size_t size() const noexcept { return buckets_.size(); }

private:
    /// A bucket's missing tokens are stored as the time when it will be full again.
    struct Bucket
    {
        Bucket() = default;
        explicit Bucket(TimePoint full) : full_at(full) {}

        TimePoint full_at = TimePoint::min();
        bool told = false;
    };

    /// What a token costs: less where there are more of them, so that every bucket is full after the same
    /// time.
    Duration interval_of(QuotaLevel const& level) const noexcept
    {
        return std::max(Duration(1), interval_ / static_cast<Duration::rep>(level.factor));
    }

    /// Out of line, so that the frequent case with one level stays small.
    [[gnu::noinline]] Verdict take_at_each_level(std::string_view key, TimePoint now)
    {
        QuotaLevels const levels(key);
        if (buckets_.size() + levels.size() > max_clients_ && buckets_.find(key) == buckets_.end())
            make_room(now);
        std::array<Bucket*, QuotaLevels::most> taken_from{}; // which stay where they are
        auto next = taken_from.begin();
        for (auto const& level : levels) {
            auto& bucket = bucket_of(level.key, now);
            if (bucket.full_at + interval_of(level) - now > capacity_)
                return refuse(level.key, bucket);
            *next++ = &bucket;
        }
        next = taken_from.begin();
        for (auto const& level : levels)
            (*next++)->full_at += interval_of(level);
        return Verdict::taken;
    }

    Verdict refuse(std::string_view key, Bucket& bucket)
    {
        refused_by_ = key;
        return std::exchange(bucket.told, true) ? Verdict::refused : Verdict::refused_first;
    }

    Bucket& bucket_of(std::string_view key, TimePoint now)
    {
        auto found = buckets_.find(key);
        if (found == buckets_.end())
            found = buckets_.try_emplace(std::string(key)).first;
        if (found->second.full_at <= now)
            found->second = Bucket(now);
        return found->second;
    }

    /// Costs about a millisecond for 10,000, once in at least 5,000 new clients.
    void make_room(TimePoint now)
    {
        std::erase_if(buckets_, [now](auto const& entry) { return entry.second.full_at <= now; });
        if (buckets_.size() <= max_clients_ / 2)
            return;
        std::vector<TimePoint> times;
        times.reserve(buckets_.size());
        for (auto const& [key, bucket] : buckets_)
            times.push_back(bucket.full_at);
        auto const middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
        std::nth_element(times.begin(), middle, times.end());
        std::erase_if(buckets_, [time = *middle](auto const& entry) { return entry.second.full_at <= time; });
    }

    std::size_t max_clients_ = 1;
    Duration interval_{};
    Duration capacity_{};
    std::unordered_map<std::string, Bucket, QuotaKeyHash, std::equal_to<>> buckets_;
    std::string refused_by_;
};

} // namespace webots_cloud::core
