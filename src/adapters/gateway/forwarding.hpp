// One request on its way to another server, until that has begun to answer.
#pragma once

#include "adapters/messages/forward_text.hpp"
#include "kept_upstream.hpp"
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
    /// and says who asks. `kept`: of the same browser's last request; it is used if it leads there.
    Forwarding(boost::asio::any_io_executor const& executor, Upstreams& upstreams, std::size_t& open,
               Forward forward, HttpRequestReader const& reader, IncomingRequest const& request,
               std::unique_ptr<KeptUpstream> kept);
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

    /// After a failure: the connection was kept, and the other server has closed it instead of answering.
    /// Then both steps may be taken again, with a new one.
    bool was_closed_meanwhile() const noexcept
    {
        return is_reused_ && received_ == 0 && !is_ended_ && !is_late_;
    }

    /// After the answer's head: once its body has been read, the connection may be used again.
    bool may_be_kept() const noexcept;

    /// Ends what waits, which then fails with `timed_out`.
    void give_up() noexcept;

    /// Ends what waits.
    void end() override;

    bool is_upgrade() const noexcept { return is_upgrade_; }
    bool is_in_messages() const noexcept { return forward_.in_messages; }
    ForwardedResponse const& response() const noexcept { return response_; }

    /// Where the request went, for the log.
    std::string destination() const;

    /// What has come of the body already.
    std::string_view begun_body() const noexcept
    {
        return std::string_view(buffer_.get(), received_).substr(response_.head_size());
    }
    NetworkStream::Released release_socket() noexcept { return socket_.release(); }
    Upstream const& upstream() const noexcept { return forward_.upstream; }
    std::shared_ptr<TunnelGroup> const& group() const noexcept { return forward_.group; }

    /// Bytes of the request.
    std::size_t request_size() const noexcept { return request_.size(); }

private:
    Failure why(Failure failure) const;

    std::size_t& open_;
    Forward forward_;
    bool is_repeatable_; ///< And so may use a connection that turns out to be closed.
    std::string request_;
    bool is_upgrade_;
    ForwardedResponse response_;
    UpstreamSocket socket_;
    std::unique_ptr<KeptUpstream> kept_;
    bool is_reused_ = false;
    std::unique_ptr<char[]> buffer_; ///< For the head of the answer, and what comes with it.
    std::size_t capacity_ = 0;
    std::size_t received_ = 0;
    bool is_late_ = false;
    bool is_ended_ = false;
};

} // namespace webots_cloud::adapters
