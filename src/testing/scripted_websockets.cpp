// A fake WebSocket client whose peers answer as a script says, at moments of the test's own clock.
#include <webots_cloud/testing/scripted_websockets.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace webots_cloud::testing {

namespace {

constexpr std::uint16_t message_too_big = 1009; // RFC 6455, 7.4.1

} // namespace

/// What the caller of `connect` has; the peer outlives it.
class ScriptedWebSockets::OpenChannel final : public Channel
{
public:
    OpenChannel(std::shared_ptr<Peer> peer, Clock& clock) : peer_(std::move(peer)), clock_(clock) {}
    ~OpenChannel() override { peer_->dropped_at_ = clock_.now(); }

    result<> send(std::string text) override
    {
        auto& channel = peer_->channel_;
        if (peer_->reads_)
            return channel.send(std::move(text));
        auto const size = text.size();
        if (channel.unread + size > peer_->request_.max_queued) {
            channel.browser_is_lost();
            channel.unread = 0;
            peer_->reads_ = true; // what is sent next learns that it is closed
            return Failure(errc::too_large, "the other side does not read what it is sent");
        }
        channel.unread += size;
        return {};
    }

    boost::asio::awaitable<result<std::string>> receive() override { return peer_->channel_.receive(); }

    void close(std::uint16_t code, std::string reason) override
    {
        peer_->channel_.close(code, std::move(reason));
    }

    std::size_t queued() noexcept override { return peer_->channel_.queued(); }
    std::uint16_t farewell() const noexcept override { return peer_->channel_.farewell(); }

private:
    std::shared_ptr<Peer> peer_;
    Clock& clock_;
};

ScriptedWebSockets::Step& ScriptedWebSockets::Step::after(Duration delay)
{
    delay_ = delay;
    return *this;
}

ScriptedWebSockets::Step& ScriptedWebSockets::Step::accept()
{
    answer_ = {};
    return *this;
}

ScriptedWebSockets::Step& ScriptedWebSockets::Step::fail(Failure failure)
{
    answer_ = std::move(failure);
    return *this;
}

ScriptedWebSockets::Step& ScriptedWebSockets::Step::hang()
{
    return after(std::chrono::hours(24 * 365));
}

ScriptedWebSockets::Step& ScriptedWebSockets::Step::always()
{
    repeated_ = true;
    return *this;
}

ScriptedWebSockets::Peer::Peer(boost::asio::any_io_executor executor, WebSocketRequest request)
    : request_(std::move(request)), channel_(std::move(executor))
{}

void ScriptedWebSockets::Peer::says(std::string text)
{
    if (text.size() > request_.max_message)
        channel_.close(message_too_big);
    else
        channel_.browser_says(std::move(text));
}

void ScriptedWebSockets::Peer::closes(std::uint16_t code)
{
    channel_.browser_leaves(code);
}

void ScriptedWebSockets::Peer::is_lost()
{
    channel_.browser_is_lost();
}

void ScriptedWebSockets::Peer::stops_reading()
{
    reads_ = false;
}

ScriptedWebSockets::Step& ScriptedWebSockets::expect(std::string const& url)
{
    return script_[url].emplace_back();
}

boost::asio::awaitable<result<std::unique_ptr<Channel>>> ScriptedWebSockets::connect(WebSocketRequest request)
{
    requests_.push_back(request);
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    auto const steps = script_.find(request.url);
    if (steps == script_.end() || steps->second.empty())
        co_return Failure(errc::unreachable,
                          "not in the script: " + request.url + "\nleft of it:\n" + unused());
    Step const step = steps->second.front();
    if (!step.repeated_)
        steps->second.pop_front();
    bool const in_time = step.delay_ < request.timeout;
    auto const waited = co_await clock_.wait_until(clock_.now() + (in_time ? step.delay_ : request.timeout));
    if (!waited)
        co_return waited.error();
    if (!in_time)
        co_return Failure(errc::timed_out);
    if (!step.answer_)
        co_return step.answer_.error();
    auto const executor = co_await boost::asio::this_coro::executor;
    auto peer = std::make_shared<Peer>(executor, std::move(request));
    peers_.push_back(peer);
    std::unique_ptr<Channel> channel = std::make_unique<OpenChannel>(std::move(peer), clock_);
    co_return channel;
}

ScriptedWebSockets::Peer& ScriptedWebSockets::peer(std::string_view url)
{
    auto const found = std::find_if(peers_.rbegin(), peers_.rend(),
                                    [&](auto const& peer) { return peer->request().url == url; });
    if (found == peers_.rend())
        throw std::out_of_range("no channel was accepted for " + std::string(url));
    return **found;
}

std::string ScriptedWebSockets::unused() const
{
    std::string lines;
    for (auto const& [url, steps] : script_)
        for (auto const& step : steps)
            if (!step.repeated_)
                lines += url + "\n";
    return lines;
}

} // namespace webots_cloud::testing
