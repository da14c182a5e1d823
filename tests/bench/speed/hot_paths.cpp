// What runs for every request, report, frame and message, alone and N times, for instruction_counts.py to
// count its instructions.
//
//     hot_paths NAME N        (without arguments: the names, one a line)
#include "adapters/messages/http_request_reader.hpp"
#include "adapters/messages/http_response_text.hpp"
#include "adapters/messages/websocket_frames.hpp"
#include "core/access/client_address.hpp"
#include "core/simulation/client_protocol.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/session_service.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

using namespace webots_cloud;

namespace {

std::size_t sink = 0; // what was computed is used

/// A scheduler of idle machines.
Scheduler fleet(int machines)
{
    Scheduler scheduler;
    std::vector<ServerSpec> specs;
    for (int i = 0; i < machines; ++i)
        specs.emplace_back("machine" + std::to_string(i) + ":2000");
    scheduler.set_servers(specs);
    for (auto const& spec : specs)
        scheduler.report(spec.address, LoadReport(10), TimePoint(std::chrono::hours(1)));
    return scheduler;
}

void place(int times)
{
    auto scheduler = fleet(1000);
    for (int i = 0; i < times; ++i)
        sink += scheduler.place(TimePoint(std::chrono::hours(1))).value().address.size();
}

void report(int times)
{
    auto scheduler = fleet(1000);
    TimePoint now(std::chrono::hours(1));
    for (int i = 0; i < times; ++i) {
        scheduler.report("machine" + std::to_string(i % 1000) + ":2000", LoadReport(10 + i % 7), now);
        now += std::chrono::milliseconds(5);
    }
}

/// Answers at once: what is counted is what stands in front of it.
class Door final : public Endpoint
{
public:
    Answer respond(IncomingRequest const& request) override
    {
        if (request.upgrade)
            return AcceptWebSocket();
        return HttpResponse(200, {}, {});
    }

    boost::asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }
};

using Headers = std::vector<std::pair<std::string_view, std::string_view>>;

void let_in(AccessConfig config, IncomingRequest const& request, int times)
{
    Door door;
    testing::World world;
    AccessControl access(std::move(config), GuardedServer(), door, world.clock, Logger());
    for (int i = 0; i < times; ++i) {
        auto const answer = access.respond(request);
        auto const* const response = std::get_if<HttpResponse>(&answer);
        if (response && response->status != 200)
            std::abort();
        sink += response ? response->fixed_headers.size() : 1;
    }
}

/// Where the name of the host is looked at: on a server of this machine.
void let_request_in(int times)
{
    IncomingRequest request;
    request.method = "GET";
    request.path = "/session";
    request.client = "127.0.0.1";
    Headers const headers{{"Host", "localhost:1999"}, {"User-Agent", "Mozilla/5.0"}, {"Accept", "*/*"}};
    request.headers = headers;
    let_in(AccessConfig(), request, times);
}

/// Where the origin of the page is looked at as well.
void let_page_in(int times)
{
    AccessConfig config;
    config.host_names = {"pc7", "pc7.example.org"};
    config.allowed_origins = {"https://*.example.org", "https://webots.cloud"};
    IncomingRequest request;
    request.method = "GET";
    request.path = "/client";
    request.client = "192.0.2.1";
    request.upgrade = true;
    Headers const headers{
        {"Host", "pc7.example.org:2000"}, {"Origin", "https://webots.cloud"}, {"Upgrade", "websocket"}};
    request.headers = headers;
    let_in(std::move(config), request, times);
}

/// From the bytes of GET /session to those of its answer, on a site that is everybody's.
void session(int times)
{
    testing::World world;
    testing::ScriptedHttp http(world.clock);
    LoadMonitor monitor(http, world.clock);
    auto scheduler = fleet(10);
    SessionConfig config;
    config.service.session_burst = 100'000;
    config.service.session_rate = 10;
    Fleet machines;
    SessionService service(config, machines, monitor, scheduler, world.clock, Logger());
    AccessControl access(AccessConfig(), GuardedServer("example.org"), service, world.clock, Logger());
    adapters::HttpRequestReader reader;
    std::string const request =
        "GET /session?url=https://github.com/o/r/blob/main/worlds/a.wbt HTTP/1.1\r\nHost: example.org\r\n"
        "User-Agent: Mozilla/5.0\r\nAccept: */*\r\n\r\n";
    std::string answer;
    for (int i = 0; i < times; ++i) {
        auto const room = reader.prepare();
        std::copy(request.begin(), request.end(), room.begin());
        reader.commit(request.size());
        if (reader.parse() != adapters::HttpRequestReader::Progress::complete)
            std::abort();
        auto asked = reader.request();
        asked.client = asked.quota_key = "203.0.113.7";
        answer.clear();
        adapters::append_response(answer, std::get<HttpResponse>(access.respond(asked)), true, true);
        sink += answer.size();
        reader.next();
    }
}

/// What a request costs more that came through a proxy.
void client_behind_proxy(int times)
{
    core::IpNetworks const proxies({"127.0.0.0/8", "::1"});
    std::vector<std::pair<std::string_view, std::string_view>> const fields{
        {"Host", "localhost:1999"}, {"X-Forwarded-For", "192.0.2.1, 203.0.113.7"}, {"Accept", "*/*"}};
    for (int i = 0; i < times; ++i) {
        auto const client = core::forwarded_client(fields, proxies);
        sink += client->text().size() + (proxies.contains(*client) ? 1 : 0);
    }
}

void load_report(int times)
{
    for (int i = 0; i < times; ++i)
        sink +=
            parse_load_report(
                R"({"load":12.5,"sessions":3,"starting":1,"capacity":100,"draining":false,"version":"1"})")
                .has_value();
}

void client_message(int times)
{
    for (int i = 0; i < times; ++i)
        sink += core::parse_client_message(
                    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})")
                    .index();
}

void world_url(int times)
{
    for (int i = 0; i < times; ++i)
        sink +=
            parse_world_url("https://github.com/owner/repository/blob/main/projects/robots/worlds/arena.wbt",
                            {"https://github.com"})
                .has_value();
}

void browser_frame(int times)
{
    adapters::WebSocketFrameReader reader(64 * 1024);
    std::string const frame("\x81\x85\x01\x02\x03\x04ifokn", 11);
    for (int i = 0; i < times; ++i) {
        std::string_view bytes = frame;
        sink += reader.next(bytes).payload.size();
    }
}

std::map<std::string, void (*)(int)> const paths = {{"place, 1,000 machines", place},
                                                    {"report, 1,000 machines", report},
                                                    {"GET /session, from bytes to bytes", session},
                                                    {"let a request in", let_request_in},
                                                    {"let a WebSocket of a page in", let_page_in},
                                                    {"name the client behind a proxy", client_behind_proxy},
                                                    {"read a load report", load_report},
                                                    {"read a start message", client_message},
                                                    {"read the URL of a world", world_url},
                                                    {"read a frame of a browser", browser_frame}};

} // namespace

int main(int argc, char** argv)
{
    if (argc == 1)
        for (auto const& [name, path] : paths)
            std::puts(name.c_str());
    if (argc != 3)
        return argc == 1 ? 0 : 2;
    auto const found = paths.find(argv[1]);
    if (found == paths.end())
        return 2;
    found->second(std::atoi(argv[2]));
    return sink == static_cast<std::size_t>(-1);
}
