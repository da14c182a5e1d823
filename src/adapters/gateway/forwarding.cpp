#include "forwarding.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <cstring>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

constexpr std::size_t first_read = 16 * 1024; // many an answer comes whole

/// RFC 9112, 9.3.1: who keeps a connection must be ready to ask again.
bool is_repeatable(Forward const& forward, HttpRequestReader const& reader, IncomingRequest const& request)
{
    bool const is_reading = request.method == "GET" || request.method == "HEAD";
    return forward.upstream.tls && is_reading && !request.upgrade && !reader.is_http_1_0();
}

} // namespace

Forwarding::Forwarding(asio::any_io_executor const& executor, Upstreams& upstreams, std::size_t& open,
                       Forward forward, HttpRequestReader const& reader, IncomingRequest const& request,
                       std::unique_ptr<KeptUpstream> kept)
    : open_(open), forward_(std::move(forward)), is_repeatable_(is_repeatable(forward_, reader, request)),
      request_(forwarded_request(reader, request, forward_, is_repeatable_)), is_upgrade_(request.upgrade),
      response_(forward_.kind, request.method == "HEAD", request.upgrade && !forward_.in_messages),
      socket_(executor, upstreams)
{
    if (kept && is_repeatable_ && kept->is_good_for(forward_.upstream))
        kept_ = std::move(kept);
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
    is_reused_ = kept_ != nullptr;
    if (is_reused_) {
        socket_.adopt(kept_->release());
        kept_.reset();
        co_return result<>();
    }
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
        // The head is parsed from its beginning each time, so it lies in one piece, which doubles as needed.
        // `parse` refuses one that is too large: this comes to an end.
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

bool Forwarding::may_be_kept() const noexcept
{
    using Body = ForwardedResponse::Body;
    bool const has_end = response_.body() == Body::none || response_.body() == Body::counted;
    return is_repeatable_ && has_end && response_.keeps_connection() &&
           begun_body().size() <= response_.length(); // and no more than that
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
