#include "relay_messages.hpp"

#include "core/text.hpp"

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr char before_entry = '@'; // in no token

std::string text_of(json::object const& object, std::string_view key)
{
    auto const* value = object.if_contains(key);
    return value && value->is_string() ? std::string(value->get_string()) : std::string();
}

bool is_true(json::object const& object, std::string_view key)
{
    auto const* value = object.if_contains(key);
    return value && value->is_bool() && value->get_bool();
}

json::object parse_object(std::string_view text)
{
    boost::system::error_code error;
    auto value = json::parse(text, error);
    return error || !value.is_object() ? json::object() : std::move(value.get_object());
}

/// Where a request has its members: in `start`, or, as `init` is a list, beside it.
json::object& members_of(json::object& request)
{
    auto* const start = request.if_contains("init") ? nullptr : request.if_contains("start");
    return start && start->is_object() ? start->get_object() : request;
}

} // namespace

RelayOptions relay_options(std::string_view request)
{
    auto object = parse_object(request);
    auto const& members = members_of(object);
    RelayOptions options;
    options.shows_waiting = is_true(members, "waiting");
    options.waiting_ticket = text_of(members, "waitingTicket");
    options.student = text_of(members, "class");
    options.wants_heartbeat = is_true(members, "heartbeat");
    options.can_return = is_true(members, "reconnect");
    options.wants_reasons = is_true(members, "reasons");
    return options;
}

std::string request_for_machine(std::string_view request)
{
    auto object = parse_object(request);
    auto& members = members_of(object);
    for (auto const* key : {"waiting", "waitingTicket", "class"})
        members.erase(key);
    members["relayed"] = true;
    members["heartbeat"] = true;
    return json::serialize(object);
}

std::string reconnect_message(std::string_view token)
{
    return json::serialize(json::object({{"reconnect", token}}));
}

std::string relayed_token(std::string_view token, std::string_view entry)
{
    return concat(token, std::string_view(&before_entry, 1), entry);
}

std::optional<RelayedToken> parse_relayed_token(std::string_view text) noexcept
{
    auto const end = text.find(before_entry);
    if (end == 0 || end == std::string_view::npos || end + 1 == text.size())
        return std::nullopt;
    return RelayedToken{text.substr(0, end), text.substr(end + 1)};
}

} // namespace webots_cloud::core
