// One request on its way to another server, until that has begun to answer.
#pragma once

#include "forward_text.hpp"
#include "upstream_socket.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// Without deadlines of its own: `give_up` ends what waits.
///
/// Lifetime: its coroutines must have ended before it goes.   Thread-safety: one executor.
class Forwarding final : public TunnelGroup::Tunnel
{
public:
    /// `open` counts those that there are; `upstreams` and `open` must outlive it. `request` is the reader's,
    /// and says who asks.
    Forwarding(boost::asio::any_io_executor const& executor, Upstreams& upstreams, std::size_t& open,
               Forward forward, HttpRequestReader const& reader, IncomingRequest const& request);
    Forwarding(Forwarding const&) = delete;
    Forwarding& operator=(Forwarding const&) = delete;
    ~Forwarding();

    /// Errors, with a reason for the log: `unreachable`; `invalid_config`, of whom to trust; `timed_out`
    /// after `give_up`; `closed` with the group.
    boost::asio::awaitable<result<>> connect();

    /// Sends the request, and reads the head of the answer.
    ///
    /// Errors: as above; `protocol_error`.
    boost::asio::awaitable<result<>> ask();

    /// Ends what waits, which then fails with `timed_out`.
    void give_up() noexcept;

    /// Ends what waits.
    void end() override;

    bool is_upgrade() const noexcept { return is_upgrade_; }
    ForwardedResponse const& response() const noexcept { return response_; }

    /// Where the request went, for the log.
    std::string destination() const;

    /// What has come of the body already.
    std::string_view begun_body() const noexcept
    {
        return std::string_view(buffer_.get(), received_).substr(response_.head_size());
    }
    NetworkStream::Released release_socket() noexcept { return socket_.release(); }
    std::shared_ptr<TunnelGroup> const& group() const noexcept { return forward_.group; }

    /// Bytes of the request.
    std::size_t request_size() const noexcept { return request_.size(); }

private:
    Failure why(Failure failure) const;

    std::size_t& open_;
    Forward forward_;
    std::string request_;
    bool is_upgrade_;
    ForwardedResponse response_;
    UpstreamSocket socket_;
    std::unique_ptr<char[]> buffer_; ///< For the head of the answer, and what comes with it.
    std::size_t capacity_ = 0;
    std::size_t received_ = 0;
    bool is_late_ = false;
    bool is_ended_ = false;
};

} // namespace webots_cloud::adapters
