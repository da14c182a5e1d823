#include <webots_cloud/testing/scripted_http.hpp>

namespace webots_cloud::testing {

ScriptedHttp::Step& ScriptedHttp::Step::after(Duration delay)
{
    delay_ = delay;
    return *this;
}

ScriptedHttp::Step& ScriptedHttp::Step::reply(int status, std::string body, HttpHeaders headers)
{
    HttpResponse response(status, "text/html; charset=UTF-8", std::move(body));
    response.headers = std::move(headers);
    answer_ = std::move(response);
    return *this;
}

ScriptedHttp::Step& ScriptedHttp::Step::fail(Failure failure)
{
    answer_ = std::move(failure);
    return *this;
}

ScriptedHttp::Step& ScriptedHttp::Step::hang()
{
    return after(std::chrono::hours(24 * 365));
}

ScriptedHttp::Step& ScriptedHttp::Step::always()
{
    repeated_ = true;
    return *this;
}

ScriptedHttp::Step& ScriptedHttp::expect(std::string const& request)
{
    return script_[request].emplace_back();
}

boost::asio::awaitable<result<HttpResponse>> ScriptedHttp::send(HttpRequest request)
{
    requests_.push_back(request);
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    auto const name = request.method + " " + request.url;
    auto const steps = script_.find(name);
    if (steps == script_.end() || steps->second.empty())
        co_return Failure(errc::unreachable, "not in the script: " + name + "\nleft of it:\n" + unused());
    Step const step = steps->second.front();
    if (!step.repeated_)
        steps->second.pop_front();
    bool const in_time = step.delay_ < request.timeout;
    auto const waited = co_await clock_.wait_until(clock_.now() + (in_time ? step.delay_ : request.timeout));
    if (!waited)
        co_return waited.error();
    if (!in_time)
        co_return Failure(errc::timed_out);
    co_return step.answer_;
}

std::string ScriptedHttp::unused() const
{
    std::string lines;
    for (auto const& [name, steps] : script_)
        for (auto const& step : steps)
            if (!step.repeated_)
                lines += name + "\n";
    return lines;
}

} // namespace webots_cloud::testing
