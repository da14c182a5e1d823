// An HTTP client that answers from a script.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <deque>
#include <map>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Reads like a timetable: `http.expect("GET http://a:2000/load").after(2s).reply(200, "42");`
///
/// Answers to the same request are given in the order of the script; one with `always()` is repeated for
/// ever. A request that is not in the script fails with a message that quotes the script.
/// Lifetime: `clock` must outlive it.
class ScriptedHttp final : public HttpClient
{
public:
    explicit ScriptedHttp(Clock& clock) : clock_(clock) {}

    /// How one request is answered.
    class Step
    {
    public:
        /// The answer takes that long; requests with a shorter timeout get `timed_out`.
        Step& after(Duration delay);
        Step& reply(int status, std::string body, HttpHeaders headers = {});
        Step& fail(Failure failure);
        /// The peer never answers.
        Step& hang();
        /// This step answers all further requests.
        Step& always();

    private:
        friend ScriptedHttp;

        Duration delay_{};
        result<HttpResponse> answer_ = HttpResponse();
        bool repeated_ = false;
    };

    /// The next answer to `request`, which is a method, a space and a URL.
    Step& expect(std::string const& request);

    boost::asio::awaitable<result<HttpResponse>> send(HttpRequest request) override;

    /// All requests so far, in order.
    std::vector<HttpRequest> const& requests() const noexcept { return requests_; }

    /// Expected requests that were not made, a line each; should be empty at the end of a test.
    std::string unused() const;

    Fuse fuse;

private:
    Clock& clock_;
    std::map<std::string, std::deque<Step>> script_;
    std::vector<HttpRequest> requests_;
};

} // namespace webots_cloud::testing
