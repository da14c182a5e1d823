// Limits how many of something each client may have.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>

namespace webots_cloud::core {

/// Counts what clients hold, by their quota keys, and refuses more than a limit.   Lifetime: must outlive
/// its tickets.
class ClientLimit
{
    struct Entry
    {
        std::size_t held = 0;
        bool told = false;
    };
    using Entries = std::unordered_map<std::string, Entry>;

public:
    /// 0: no limit.
    explicit ClientLimit(std::size_t max = 0) : max_(max) {}
    ClientLimit(ClientLimit const&) = delete;
    ClientLimit& operator=(ClientLimit const&) = delete;

    /// The right to one, given back when it is destroyed.
    class Ticket
    {
    public:
        Ticket() = default; ///< For what is not counted.
        Ticket(Ticket&& other) noexcept
            : limit_(std::exchange(other.limit_, nullptr)), entry_(std::exchange(other.entry_, nullptr))
        {}
        Ticket& operator=(Ticket&& other) noexcept
        {
            if (this != &other) {
                release();
                limit_ = std::exchange(other.limit_, nullptr);
                entry_ = std::exchange(other.entry_, nullptr);
            }
            return *this;
        }
        ~Ticket() { release(); }

        /// Gives the right back now.
        void release()
        {
            if (auto* const entry = std::exchange(entry_, nullptr))
                limit_->give_back(*entry);
        }

    private:
        friend ClientLimit;
        Ticket(ClientLimit& limit, Entries::value_type& entry) : limit_(&limit), entry_(&entry) {}

        ClientLimit* limit_ = nullptr;
        Entries::value_type* entry_ = nullptr;
    };

    enum class Verdict
    {
        admitted,
        refused_first, ///< The first refusal since the client had nothing: worth a line in the log.
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
        auto& entry = *entries_.try_emplace(key).first;
        if (max_ > 0 && entry.second.held >= max_)
            return std::exchange(entry.second.told, true) ? Verdict::refused : Verdict::refused_first;
        ++entry.second.held;
        ticket = Ticket(*this, entry);
        return Verdict::admitted;
    }

    std::size_t max() const noexcept { return max_; }

    /// Clients that have more already keep it.
    void set_max(std::size_t max) noexcept { max_ = max; }

    /// Clients that have something.
    std::size_t clients() const noexcept { return entries_.size(); }

private:
    void give_back(Entries::value_type const& entry)
    {
        auto const found = entries_.find(entry.first);
        if (--found->second.held == 0)
            entries_.erase(found);
    }

    std::size_t max_;
    Entries entries_; // whose elements stay where they are
};

} // namespace webots_cloud::core
