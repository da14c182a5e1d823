#include <webots_cloud/adapters/host.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/steady_timer.hpp>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

class SteadyClock final : public Clock
{
public:
    explicit SteadyClock(asio::any_io_executor executor) : executor_(std::move(executor)) {}

    TimePoint now() const noexcept override { return std::chrono::steady_clock::now(); }
    WallTime wall() const noexcept override { return std::chrono::system_clock::now(); }

    asio::awaitable<result<>> wait_until(TimePoint when) override
    {
        asio::steady_timer timer(executor_, when);
        auto const [error] = co_await timer.async_wait(asio::as_tuple(asio::deferred));
        if (error)
            co_return Failure(error);
        co_return result<>();
    }

private:
    asio::any_io_executor executor_;
};

} // namespace

std::unique_ptr<Clock> make_steady_clock(asio::any_io_executor executor)
{
    return std::make_unique<SteadyClock>(std::move(executor));
}

} // namespace webots_cloud
