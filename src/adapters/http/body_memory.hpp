// The memory for bodies of requests: bounded for all together, and for each client.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace webots_cloud::adapters {

/// Counts bytes by the quota keys of clients. The empty key belongs to no client, and is bounded with all.
class BodyMemory
{
public:
    explicit BodyMemory(std::size_t limit) : limit_(limit) {}

    /// One client has a quarter at most, so that others find room.
    bool has_room(std::string const& key, std::size_t size) const
    {
        if (used_ + size > limit_)
            return false;
        auto const found = key.empty() ? clients_.end() : clients_.find(key);
        return key.empty() || (found == clients_.end() ? 0 : found->second) + size <= limit_ / 4;
    }

    void add(std::string const& key, std::size_t size)
    {
        used_ += size;
        if (!key.empty() && size > 0)
            clients_[key] += size;
    }

    void remove(std::string const& key, std::size_t size)
    {
        used_ -= size;
        auto const found = clients_.find(key);
        if (found != clients_.end() && (found->second -= size) == 0)
            clients_.erase(found);
    }

private:
    std::size_t limit_;
    std::size_t used_ = 0;
    std::unordered_map<std::string, std::size_t> clients_; ///< Those of which there is a body.
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

    bool has_room(std::size_t size) const { return memory_.has_room(client_, size); }

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
