// Reads one picture of a simulator's stream, reached as the gateway reaches it, and hangs up.
#include "core/simulation/first_picture.hpp"
#include "upstream_visit.hpp"
#include "upstreams.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/transport/picture_taker.hpp>

#include <algorithm>
#include <chrono>
#include <utility>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

constexpr auto patience = std::chrono::seconds(5);          // for all of it: connection, request, picture
constexpr std::size_t picture_read = std::size_t{32} << 10; // at once
constexpr std::string_view picture_request = "GET /mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n";

/// Takes the first picture of a simulator's stream, and hangs up.
class GatewayPictureTaker final : public PictureTaker
{
public:
    GatewayPictureTaker(asio::any_io_executor executor, Logger log)
        : executor_(std::move(executor)), upstreams_(executor_, params_, statistics_, std::move(log))
    {}

    asio::awaitable<result<std::string>> take(Upstream simulator) override
    {
        adapters::UpstreamVisit visit(executor_, upstreams_, patience);
        auto taken = co_await read_one(visit.socket(), simulator);
        if (!taken && visit.is_late())
            co_return Failure(errc::timed_out);
        co_return taken;
    }

private:
    static asio::awaitable<result<std::string>> read_one(adapters::UpstreamSocket& socket,
                                                         Upstream const& simulator)
    {
        auto const connected = co_await socket.connect(simulator);
        if (!connected)
            co_return connected.error();
        auto const written = co_await socket.write(picture_request);
        if (written)
            co_return Failure(errc::unreachable, written.message());
        std::string answer;
        while (answer.size() < core::max_picture_answer) {
            auto const had = answer.size();
            answer.resize(had + picture_read);
            auto const [error, got] = co_await socket.read_some(answer.data() + had, picture_read);
            answer.resize(had + got);
            auto const first = core::first_picture(answer);
            if (first.state == core::FirstPicture::State::found)
                co_return std::string(first.picture);
            if (error || first.state == core::FirstPicture::State::none)
                break;
        }
        co_return Failure(errc::protocol_error, "no picture comes");
    }

    asio::any_io_executor executor_;
    HttpServerParams params_;
    HttpServerStatistics statistics_;
    adapters::Upstreams upstreams_;
};

} // namespace

std::unique_ptr<PictureTaker> make_picture_taker(asio::any_io_executor executor, Logger log)
{
    return std::make_unique<GatewayPictureTaker>(std::move(executor), std::move(log));
}

} // namespace webots_cloud
