#include "doctor_endpoint.hpp"

#include "core/pages/http_methods.hpp"
#include "core/pages/http_pages.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;

namespace {

constexpr auto fresh = std::chrono::seconds(30); // mail servers and forges are asked no more often
constexpr std::size_t instance_length = 16;

} // namespace

DoctorEndpoint::DoctorEndpoint(asio::any_io_executor executor, Endpoint& service, Clock& clock)
    : EndpointInFront(service), clock_(clock), instance_(make_token().substr(0, instance_length)),
      asked_(executor)
{
    asked_.expires_at(asio::steady_timer::time_point::max());
}

Answer DoctorEndpoint::respond(IncomingRequest const& request)
{
    if (request.path == "/api/doctor" && request.is_operator)
        return report(request);
    auto answer = EndpointInFront::respond(request);
    if (auto* const page = std::get_if<HttpResponse>(&answer); page && request.path.starts_with("/livez"))
        page->headers.emplace_back(instance_header, instance_);
    return answer;
}

Answer DoctorEndpoint::report(IncomingRequest const& request)
{
    if (!core::permits(core::Methods::read, request.method))
        return core::method_not_allowed_page(core::allow_header(core::Methods::read));
    bool const is_old = !examination_.when || clock_.now() >= fresh_until_;
    if (request.query != "last" && is_old && !examination_.is_under_way) {
        examination_.is_under_way = true;
        asked_.cancel();
    }
    return core::json_page(core::examination_json(examination_, instance_));
}

asio::awaitable<result<>> DoctorEndpoint::run(Look look)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const cancelled = (co_await asio::this_coro::cancellation_state).cancelled();
        if (cancelled != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
        if (!examination_.is_under_way) {
            (void)co_await asked_.async_wait(asio::as_tuple(asio::use_awaitable));
            continue;
        }
        auto looking = look();
        examination_.findings = co_await std::move(looking);
        examination_.when = clock_.wall();
        fresh_until_ = clock_.now() + fresh;
        examination_.is_under_way = false;
    }
}

} // namespace webots_cloud::app
