#include "web_probe.hpp"

#include "curl_http.hpp"

namespace webots_cloud::adapters {

result<int> try_web_server(std::string const& url, Duration timeout)
{
    constexpr int ok = 200;
    constexpr int found_elsewhere = 302;
    int answered = 0; // as soon as the status is known
    CurlRequest request;
    request.peer = "the server";
    request.base = url;
    request.url = url.ends_with('/') ? url : url + "/";
    request.agent = "webots_cloud";
    request.sink = [&answered](std::string_view) {
        answered = ok;
        return result<>(Failure(errc::closed));
    };
    request.may_redirect = [&answered](std::string const&) {
        answered = found_elsewhere;
        return result<>(Failure(errc::closed));
    };
    CurlLimits limits;
    limits.deadline = std::chrono::steady_clock::now() + timeout;
    CurlHttp http;
    auto const status = http.send(request, limits);
    return answered != 0 ? result<int>(answered) : status;
}

} // namespace webots_cloud::adapters
