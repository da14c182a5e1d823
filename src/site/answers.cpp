#include "answers.hpp"

#include "adapters/http_client/own_server_probe.hpp"
#include "core/text.hpp"

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

namespace webots_cloud::site {
namespace {

namespace json = boost::json;
using core::concat;

constexpr Duration answer_limit = std::chrono::seconds(5);

result<HttpResponse> ask(Settings const& settings, std::string const& target)
{
    adapters::OwnServer server;
    server.address = own_address(settings.listen_address);
    server.port = settings.address.port;
    server.tls = !settings.certificate.empty();
    return adapters::ask_own_server(server, target, answer_limit);
}

json::object parse_object(std::string_view text)
{
    json::error_code failed;
    auto value = json::parse(text, failed);
    return !failed && value.is_object() ? std::move(value.as_object()) : json::object();
}

std::string_view text_of(json::object const& object, std::string_view key)
{
    auto const* const value = object.if_contains(key);
    if (!value || !value->is_string())
        return {};
    auto const& text = value->get_string();
    return {text.data(), text.size()};
}

std::optional<std::int64_t> number_of(json::object const& object, std::string_view key)
{
    auto const* const value = object.if_contains(key);
    return value && value->is_int64() ? std::optional(value->get_int64()) : std::nullopt;
}

} // namespace

bool answers(Settings const& settings)
{
    return ask(settings, settings.kind == Kind::website_host ? "/" : "/load").has_value();
}

bool has_room(Settings const& settings)
{
    auto const answer = ask(settings, "/");
    return answer && answer->status == 200 && answer->body == "1";
}

std::string weakness(Settings const& settings)
{
    auto const answer = ask(settings, "/readyz");
    return answer ? parse_weakness(answer->body) : std::string();
}

std::string parse_weakness(std::string_view readyz)
{
    auto const answer = parse_object(readyz);
    constexpr std::size_t longest = 2000;
    return core::printable(text_of(answer, "but"), longest);
}

std::vector<std::string> state_lines(Settings const& settings)
{
    std::vector<std::string> lines;
    auto const load = ask(settings, settings.kind == Kind::website_host ? "/" : "/load");
    if (!load)
        lines.push_back(concat("It does not answer on port ", std::to_string(settings.address.port), "."));
    else if (auto seats = seats_line(load->body); seats && settings.kind == Kind::simulation)
        lines.push_back(std::move(*seats));
    if (load && settings.kind == Kind::simulation)
        if (auto const weak = weakness(settings); !weak.empty())
            lines.push_back("warning        " + weak);
    if (load && settings.kind == Kind::session)
        if (auto const monitor = ask(settings, "/monitor"); monitor && monitor->status == 200)
            for (auto& line : visitor_lines(monitor->body))
                lines.push_back(std::move(line));
    return lines;
}

std::optional<std::string> seats_line(std::string_view load)
{
    auto const report = parse_object(load);
    auto const capacity = number_of(report, "capacity");
    auto const sessions = number_of(report, "sessions");
    if (!capacity || !sessions)
        return std::nullopt;
    return concat("seats          ", std::to_string(*sessions), " of ", std::to_string(*capacity), " taken");
}

std::vector<std::string> visitor_lines(std::string_view monitor)
{
    std::vector<std::string> lines;
    auto const page = parse_object(monitor);
    if (auto const state = text_of(page, "stateText"); !state.empty())
        lines.push_back(concat("visitors       ", core::printable(state)));
    auto const* const servers = page.if_contains("servers");
    if (!servers || !servers->is_array())
        return lines;
    for (auto const& each : servers->get_array()) {
        auto const* const server = each.if_object();
        auto const refusal = server ? text_of(*server, "refusal") : std::string_view();
        if (!refusal.empty())
            lines.push_back(concat(core::printable(text_of(*server, "address")),
                                   " refused its last start: ", core::printable(refusal)));
    }
    return lines;
}

} // namespace webots_cloud::site
