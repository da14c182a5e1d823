// Limits how many of something each client may have.
#pragma once

#include "quota_counts.hpp"

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace webots_cloud::core {

/// Counts what clients hold, by their quota keys and the levels of these, and refuses more than a limit.
/// Lifetime: must outlive its tickets.
class ClientLimit
{
public:
    /// `max`: of one client; 0: no limit. `all`: how many there can be at all.
    explicit ClientLimit(std::size_t max = 0, std::size_t all = std::numeric_limits<std::size_t>::max())
        : max_(max), all_(all)
    {}
    ClientLimit(ClientLimit const&) = delete;
    ClientLimit& operator=(ClientLimit const&) = delete;

    /// The right to one, given back when it is destroyed.
    class Ticket
    {
    public:
        Ticket() = default; ///< For what is not counted.
        Ticket(Ticket&& other) noexcept
            : limit_(std::exchange(other.limit_, nullptr)), key_(std::move(other.key_))
        {}
        Ticket& operator=(Ticket&& other) noexcept
        {
            if (this != &other) {
                release();
                limit_ = std::exchange(other.limit_, nullptr);
                key_ = std::move(other.key_);
            }
            return *this;
        }
        ~Ticket() { release(); }

        /// Gives the right back now.
        void release()
        {
            if (auto* const limit = std::exchange(limit_, nullptr))
                limit->counts_.remove(key_);
        }

    private:
        friend ClientLimit;
        Ticket(ClientLimit& limit, std::string key) : limit_(&limit), key_(std::move(key)) {}

        ClientLimit* limit_ = nullptr;
        std::string key_;
    };

    enum class Verdict
    {
        admitted,
        refused_first, ///< The first refusal since the client (`refused`) had nothing: worth a line in the
                       ///< log.
        refused
    };

    /// `ticket` is replaced when the client is admitted. The empty key belongs to no client and is not
    /// counted.
    Verdict admit(std::string const& key, Ticket& ticket)
    {
        if (key.empty()) {
            ticket = Ticket();
            return Verdict::admitted;
        }
        if (auto full = max_ > 0 ? counts_.full_level(key, 1, max_, all_) : std::nullopt) {
            refused_ = std::move(*full);
            return refused_.is_news ? Verdict::refused_first : Verdict::refused;
        }
        counts_.add(key);
        ticket = Ticket(*this, key);
        return Verdict::admitted;
    }

    /// Whose limit the last refusal was due to.
    QuotaCounts::Full const& refused() const noexcept { return refused_; }

    std::size_t max() const noexcept { return max_; }

    /// Clients that have more already keep it.
    void set_max(std::size_t max) noexcept { max_ = max; }
    void set_all(std::size_t all) noexcept { all_ = all; }

    /// Clients that have something, and wider networks of them.
    std::size_t clients() const noexcept { return counts_.size(); }

private:
    std::size_t max_;
    std::size_t all_;
    QuotaCounts counts_;
    QuotaCounts::Full refused_{};
};

} // namespace webots_cloud::core
