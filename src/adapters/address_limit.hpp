// How many connections each client has.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>

namespace webots_cloud::adapters {

/// Counts connections by their clients' quota keys and refuses those over a limit.   Lifetime: must outlive
/// its tickets.
class AddressLimit
{
    struct Entry
    {
        std::size_t connections = 0;
        bool told = false;
    };
    using Entries = std::unordered_map<std::string, Entry>;

public:
    explicit AddressLimit(std::size_t most) : most_(most) {}

    /// The right to one connection, given back when it is destroyed.
    class Ticket
    {
    public:
        Ticket() = default; ///< For a connection that is not counted.
        Ticket(Ticket&& other) noexcept
            : limit_(std::exchange(other.limit_, nullptr)), entry_(std::exchange(other.entry_, nullptr))
        {}
        Ticket& operator=(Ticket&& other) noexcept
        {
            std::swap(limit_, other.limit_);
            std::swap(entry_, other.entry_);
            return *this;
        }
        ~Ticket()
        {
            if (entry_)
                limit_->release(*entry_);
        }

    private:
        friend AddressLimit;
        Ticket(AddressLimit& limit, Entries::value_type& entry) : limit_(&limit), entry_(&entry) {}

        AddressLimit* limit_ = nullptr;
        Entries::value_type* entry_ = nullptr;
    };

    enum class Verdict
    {
        admitted,
        refused_first, ///< The first refusal since the client had no connection: worth a line in the log.
        refused
    };

    /// The empty key is not counted. `ticket` is set when it is admitted.
    Verdict admit(std::string const& key, Ticket& ticket)
    {
        if (key.empty())
            return Verdict::admitted;
        auto& entry = *entries_.try_emplace(key).first;
        if (entry.second.connections >= most_)
            return std::exchange(entry.second.told, true) ? Verdict::refused : Verdict::refused_first;
        ++entry.second.connections;
        ticket = Ticket(*this, entry);
        return Verdict::admitted;
    }

private:
    void release(Entries::value_type const& entry)
    {
        auto const found = entries_.find(entry.first);
        if (--found->second.connections == 0)
            entries_.erase(found);
    }

    std::size_t most_;
    Entries entries_;
};

} // namespace webots_cloud::adapters
