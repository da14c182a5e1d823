#include "forwarding.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <cstring>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

constexpr std::size_t first_read = 16 * 1024; // many an answer comes whole

} // namespace

Forwarding::Forwarding(asio::any_io_executor const& executor, Upstreams& upstreams, std::size_t& open,
                       Forward forward, HttpRequestReader const& reader, IncomingRequest const& request)
    : open_(open), forward_(std::move(forward)), request_(forwarded_request(reader, request, forward_)),
      is_upgrade_(request.upgrade), response_(request.method == "HEAD", request.upgrade),
      socket_(executor, upstreams)
{
    ++open_;
    is_ended_ = forward_.group && !forward_.group->join(*this);
}

Forwarding::~Forwarding()
{
    --open_;
    if (forward_.group)
        forward_.group->leave(*this);
}

asio::awaitable<result<>> Forwarding::connect()
{
    if (is_ended_)
        co_return why(Failure(errc::closed));
    auto const connected = co_await socket_.connect(forward_.upstream);
    if (!connected || is_ended_ || is_late_)
        co_return why(connected ? Failure(errc::closed) : connected.error());
    co_return result<>();
}

asio::awaitable<result<>> Forwarding::ask()
{
    auto const unsent = co_await socket_.write(request_);
    if (unsent || is_ended_ || is_late_)
        co_return why(Failure(errc::unreachable, unsent.message()));
    for (;;) {
        if (received_ == capacity_) {
            auto const wanted = std::max(first_read, 2 * capacity_);
            auto larger = std::make_unique_for_overwrite<char[]>(wanted);
            if (received_ > 0)
                std::memcpy(larger.get(), buffer_.get(), received_);
            buffer_ = std::move(larger);
            capacity_ = wanted;
        }
        auto const [error, size] =
            co_await socket_.read_some(buffer_.get() + received_, capacity_ - received_);
        if (error || is_ended_ || is_late_)
            co_return why(Failure(errc::unreachable, concat("no whole answer: ", error.message())));
        received_ += size;
        auto const progress = response_.parse(std::string_view(buffer_.get(), received_));
        if (progress == ForwardedResponse::Progress::complete) {
            for (auto const& [name, value] : forward_.answer_headers)
                response_.add_missing(name, value);
            for (auto const& [name, value] : forward_.added_answer_headers)
                response_.add(name, value);
            co_return result<>();
        }
        if (progress == ForwardedResponse::Progress::malformed)
            co_return Failure(errc::protocol_error, "its answer is malformed, or its head too large");
    }
}

Failure Forwarding::why(Failure failure) const
{
    if (is_late_)
        return Failure(errc::timed_out, "it does not answer");
    if (is_ended_)
        return Failure(errc::closed, "it has been closed meanwhile");
    return failure;
}

void Forwarding::give_up() noexcept
{
    is_late_ = true;
    socket_.close();
}

void Forwarding::end()
{
    is_ended_ = true;
    socket_.close();
}

std::string Forwarding::destination() const
{
    auto const& upstream = forward_.upstream;
    if (!upstream.broker.empty())
        return upstream.broker.string();
    return concat(upstream.tls ? "https://" : "", upstream.host, ":", std::to_string(upstream.port));
}

} // namespace webots_cloud::adapters
