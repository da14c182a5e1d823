// How many connections each address has.
#pragma once

#include <boost/asio/ip/address.hpp>

#include <cstddef>
#include <unordered_map>
#include <utility>

namespace webots_cloud::adapters {

/// Counts connections by address and refuses those over a limit.   Lifetime: must outlive its tickets.
class AddressLimit
{
public:
    explicit AddressLimit(std::size_t most) : most_(most) {}

    /// The right to one connection, given back when it is destroyed.
    class Ticket
    {
    public:
        Ticket() = default; ///< For a connection that is not counted.
        Ticket(AddressLimit& limit, boost::asio::ip::address address)
            : limit_(&limit), address_(std::move(address))
        {}
        Ticket(Ticket&& other) noexcept
            : limit_(std::exchange(other.limit_, nullptr)), address_(std::move(other.address_))
        {}
        Ticket& operator=(Ticket&&) = delete;
        ~Ticket()
        {
            if (limit_)
                limit_->release(address_);
        }

    private:
        AddressLimit* limit_ = nullptr;
        boost::asio::ip::address address_;
    };

    enum class Verdict
    {
        admitted,
        refused_first, ///< The first refusal since the address had no connection: worth a line in the log.
        refused
    };

    /// On `admitted` the caller makes a Ticket at once.
    Verdict admit(boost::asio::ip::address const& address)
    {
        auto& entry = entries_[address];
        if (entry.connections >= most_)
            return std::exchange(entry.told, true) ? Verdict::refused : Verdict::refused_first;
        ++entry.connections;
        return Verdict::admitted;
    }

private:
    struct Entry
    {
        std::size_t connections = 0;
        bool told = false;
    };

    void release(boost::asio::ip::address const& address)
    {
        auto const entry = entries_.find(address);
        if (--entry->second.connections == 0)
            entries_.erase(entry);
    }

    std::size_t most_;
    std::unordered_map<boost::asio::ip::address, Entry> entries_;
};

} // namespace webots_cloud::adapters
