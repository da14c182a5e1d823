// The memory for bodies of requests: bounded for all together, and for each client.
#pragma once

#include "core/access/quota_counts.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

/// Counts bytes by the quota keys of clients. The empty key belongs to no client, and is bounded with all.
class BodyMemory
{
public:
    explicit BodyMemory(std::size_t limit) : limit_(limit) {}

    /// One client has a quarter at most, so that others find room.
    bool has_room(std::string const& key, std::size_t size)
    {
        return used_ + size <= limit_ && !clients_.full_level(key, size, limit_ / 4, limit_);
    }

    void add(std::string const& key, std::size_t size)
    {
        used_ += size;
        clients_.add(key, size);
    }

    void remove(std::string const& key, std::size_t size)
    {
        used_ -= size;
        clients_.remove(key, size);
    }

private:
    std::size_t limit_;
    std::size_t used_ = 0;
    core::QuotaCounts clients_;
};

/// The body of a request; counted as long as it exists.
class RequestBody
{
public:
    /// `client`: its quota key.
    RequestBody(BodyMemory& memory, std::string client) : memory_(memory), client_(std::move(client)) {}
    ~RequestBody() { memory_.remove(client_, text_.size()); }
    RequestBody(RequestBody const&) = delete;
    RequestBody& operator=(RequestBody const&) = delete;

    bool has_room(std::size_t size) { return memory_.has_room(client_, size); }

    void append(std::string_view bytes)
    {
        text_.append(bytes);
        memory_.add(client_, bytes.size());
    }

    std::string const& text() const noexcept { return text_; }

private:
    std::string text_;
    BodyMemory& memory_;
    std::string client_;
};

} // namespace webots_cloud::adapters
