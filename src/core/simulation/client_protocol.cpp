// Messages of browsers are untrusted: what is malformed becomes a `MalformedMessage` with its reason, never
// an exception. Forms that old pages send, or old servers sent, stay as they are; members that were added
// later mean nothing unless they have the right type.
#include "client_protocol.hpp"

#include "core/failure_json.hpp"
#include "core/public_place.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <boost/json/monotonic_resource.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

/// Members that were added later: whoever means something else by them is not refused.
bool is_true(json::object const& object, std::string_view key)
{
    auto const* value = object.if_contains(key);
    return value && value->is_bool() && value->get_bool();
}

/// Members of `start` that say what its page can do.
struct StartFlag
{
    std::string_view key;
    bool StartMessage::*member;
};

constexpr std::array<StartFlag, 8> start_flags{{
    {"reconnect", &StartMessage::can_return},
    {"heartbeat", &StartMessage::wants_heartbeat},
    {"extend", &StartMessage::can_extend},
    {"fetch_only", &StartMessage::fetch_only},
    {"relayed", &StartMessage::relayed},
    {"reasons", &StartMessage::wants_reasons},
    {"edit", &StartMessage::has_editor},
    {"run", &StartMessage::runs},
}};

/// `1280x665`
bool is_picture_size(std::string_view text)
{
    constexpr std::size_t most_digits = 4;
    auto const sides = split(text, 'x');
    return sides.size() == 2 && std::all_of(sides.begin(), sides.end(), [](std::string_view side) {
               return !side.empty() && side.size() <= most_digits && side.front() != '0' &&
                      side.find_first_not_of("0123456789") == std::string_view::npos;
           });
}

ClientMessage read_start(json::value const& value)
{
    auto const* start = value.if_object();
    if (!start)
        return MalformedMessage{"\"start\" must be an object with a \"url\""};
    auto const* url = start->if_contains("url");
    if (!url || !url->is_string())
        return MalformedMessage{"\"start\" must have a \"url\" that is a string"};
    StartMessage message;
    message.url = url->get_string();
    if (auto const* mode = start->if_contains("mode"); mode && !mode->is_null()) {
        if (!mode->is_string())
            return MalformedMessage{"the \"mode\" of \"start\" must be a string"};
        message.mode = mode->get_string();
    }
    if (auto const* size = start->if_contains("size");
        size && size->is_string() && is_picture_size(size->get_string()))
        message.picture_size = size->get_string();
    for (auto const& member : *start) {
        auto const* const is_true = member.value().if_bool();
        auto const flag = is_true && *is_true
                              ? std::find_if(start_flags.begin(), start_flags.end(),
                                             [&member](auto const& row) { return row.key == member.key(); })
                              : start_flags.end();
        if (flag != start_flags.end())
            message.*flag->member = true;
    }
    return SimulationRequest(std::move(message));
}

/// A file of the folder of the controllers; nothing: it is none, or would lead out of it.
std::optional<std::string> read_file_name(json::value const* value)
{
    constexpr std::size_t longest = 1024;
    auto const* file = value ? value->if_string() : nullptr;
    auto const parts = file ? split(*file, '/') : std::vector<std::string_view>();
    if (parts.size() < 2 || file->size() > longest ||
        !std::all_of(parts.begin(), parts.end(), is_safe_file_name))
        return std::nullopt;
    return std::string(*file);
}

MalformedMessage no_file_name(std::string_view key)
{
    return MalformedMessage{concat("\"", key, "\" must be \"<controller>/<file>\"")};
}

ClientMessage read_reset_controller(json::value const& value)
{
    auto file = read_file_name(&value);
    return file ? ClientMessage(ResetControllerMessage{std::move(*file)}) : no_file_name("reset controller");
}

ClientMessage read_read(json::value const& value, bool original)
{
    auto file = read_file_name(&value);
    return file ? ClientMessage(ReadFileMessage{std::move(*file), original})
                : no_file_name(original ? "original" : "read");
}

ClientMessage read_write(json::value const& value)
{
    auto const* write = value.if_object();
    auto const* text = write ? write->if_contains("text") : nullptr;
    if (!text || !text->is_string())
        return MalformedMessage{"\"write\" must be an object with a \"path\" and a \"text\""};
    auto file = read_file_name(write->if_contains("path"));
    return file ? ClientMessage(WriteFileMessage{std::move(*file), std::string(text->get_string())})
                : no_file_name("path");
}

ClientMessage read_compile(json::value const& value)
{
    auto const* controller = value.if_string();
    if (!controller || !is_safe_file_name(*controller))
        return MalformedMessage{"\"compile\" must be \"<controller>\""};
    return CompileMessage{std::string(*controller)};
}

ClientMessage read_stage(json::value const& value)
{
    auto message = read_stage_message(value);
    return message ? ClientMessage(std::move(*message))
                   : MalformedMessage{"\"stage\" must be a list of worlds with their number"};
}

ClientMessage read_reconnect(json::value const& value)
{
    auto const* token = value.if_string();
    if (!token)
        return MalformedMessage{"\"reconnect\" must be the token that the server gave"};
    return ReconnectMessage{std::string(*token)};
}

ClientMessage read_extend(json::value const& value)
{
    constexpr double longest = 1e7; // a third of a year
    boost::system::error_code error;
    auto const seconds = value.to_number<double>(error);
    if (error || !(seconds >= 1))
        return MalformedMessage{"\"extend\" must be a number of seconds, at least 1"};
    return ExtendMessage{std::chrono::seconds(static_cast<std::int64_t>(std::min(seconds, longest)))};
}

ClientMessage read_init(json::value const& value, json::object const& message)
{
    auto const* list = value.if_array();
    if (!list || !std::all_of(list->begin(), list->end(),
                              [](json::value const& element) { return element.is_string(); }))
        return MalformedMessage{"\"init\" must be a list of strings"};
    std::vector<std::string> elements;
    for (auto const& element : *list)
        elements.emplace_back(element.get_string());
    auto project = parse_init(elements);
    if (!project)
        return MalformedMessage{project.error().message()};
    if (auto const* mode = message.if_contains("mode"); mode && !mode->is_null()) {
        if (!mode->is_string())
            return MalformedMessage{"the \"mode\" of \"init\" must be a string"};
        project->mode = mode->get_string();
    }
    project->relayed = is_true(message, "relayed");
    project->wants_reasons = is_true(message, "reasons");
    return SimulationRequest(std::move(*project));
}

/// For people: the name as it is in the world, where it can be shown.
std::string readable_robot(std::string_view robot)
{
    std::string decoded;
    return percent_decode(robot, decoded) ? printable(decoded, 100) : printable(robot, 100);
}

} // namespace

ClientMessage parse_client_message(std::string_view text)
{
    std::array<unsigned char, 4096> room; // most messages fit, and all of it is freed at once
    json::monotonic_resource memory(room.data(), room.size());
    boost::system::error_code error;
    auto const value = json::parse(text, error, &memory); // at most 32 levels deep
    if (error)
        return MalformedMessage{concat("this message is not JSON (", error.message(), ")")};
    auto const* object = value.if_object();
    if (!object)
        return MalformedMessage{"a message must be a JSON object"};
    if (auto const* reset = object->if_contains("reset controller"))
        return read_reset_controller(*reset);
    if (auto const* reconnect = object->if_contains("reconnect"))
        return read_reconnect(*reconnect);
    if (auto const* extend = object->if_contains("extend"))
        return read_extend(*extend);
    if (auto const* init = object->if_contains("init"))
        return read_init(*init, *object);
    if (auto const* start = object->if_contains("start"))
        return read_start(*start);
    if (auto const* read = object->if_contains("read"))
        return read_read(*read, false);
    if (auto const* original = object->if_contains("original"))
        return read_read(*original, true);
    if (auto const* write = object->if_contains("write"))
        return read_write(*write);
    if (auto const* compile = object->if_contains("compile"))
        return read_compile(*compile);
    if (auto const* stage = object->if_contains("stage"))
        return read_stage(*stage);
    return UnknownMessage{};
}

bool can_return(SimulationRequest const& request)
{
    auto const* start = std::get_if<StartMessage>(&request);
    return start && start->can_return;
}

bool wants_heartbeat(SimulationRequest const& request)
{
    auto const* start = std::get_if<StartMessage>(&request);
    return start && start->wants_heartbeat;
}

bool can_extend(SimulationRequest const& request)
{
    auto const* start = std::get_if<StartMessage>(&request);
    return start && start->can_extend;
}

bool is_relayed(SimulationRequest const& request)
{
    return std::visit([](auto const& asked) { return asked.relayed; }, request);
}

bool wants_reasons(SimulationRequest const& request)
{
    return std::visit([](auto const& asked) { return asked.wants_reasons; }, request);
}

bool has_editor(SimulationRequest const& request)
{
    auto const* start = std::get_if<StartMessage>(&request);
    return start && start->has_editor;
}

bool is_fetch_only(SimulationRequest const& request)
{
    auto const* start = std::get_if<StartMessage>(&request);
    return start && start->fetch_only;
}

bool is_final(std::uint16_t close_code) noexcept
{
    constexpr std::uint16_t none = 0;
    constexpr std::uint16_t normal = 1000;
    return close_code == none || close_code == normal;
}

std::string world_of(SimulationRequest const& request)
{
    if (auto const* project = std::get_if<WebsiteProject>(&request))
        return project->url();
    return std::get<StartMessage>(request).url;
}

std::string error_message(std::string_view text)
{
    return concat(error_prefix, text);
}

std::string reason_message(Failure const& failure)
{
    if (auto const* const info = failure.info())
        return concat(reason_prefix,
                      json::serialize(json::object({{"code", info->code}, {"values", values_of(failure)}})));
    auto const code = code_of_system(failure);
    return code.empty() ? std::string() : reason_message(code);
}

std::string reason_message(std::string_view code)
{
    return concat(reason_prefix, json::serialize(json::object({{"code", code}})));
}

std::string loading_message(std::string_view text)
{
    return concat("loading: ", text);
}

std::string forbidden_file_message(std::string_view path)
{
    return concat("stderr:\"", path,
                  "\" of the project is left out: its name could do harm here. Rename it.");
}

std::string controller_message(std::string_view robot, std::string_view url)
{
    return concat(
        "stdout:Robot \"", readable_robot(robot),
        "\" waits for its controller, which may run on any machine with WEBOTS_CONTROLLER_URL=", url);
}

std::string no_controller_message(std::string_view robot)
{
    return concat("stdout:Robot \"", readable_robot(robot),
                  "\" waits for its controller, but this site takes none of other machines for this project. "
                  "Its operator can add the project to \"controllerRepositories\".");
}

std::string shutdown_timeout_message(std::int64_t seconds)
{
    return concat("shutdownTimeout: ", std::to_string(seconds));
}

std::string extendable_message(std::int64_t seconds)
{
    return concat("extendable: ", std::to_string(seconds));
}

std::string reset_controller_message(std::string_view file)
{
    return concat("reset controller: ", file);
}

std::string reconnect_token_message(std::string_view token)
{
    return concat("reconnectToken: ", token);
}

std::string said_message(std::string_view message)
{
    return concat("said: ", message);
}

std::string pictures_message(std::string_view size)
{
    return concat("pictures: ", size);
}

std::string webots_message(PublicAddress const& address, std::uint16_t port)
{
    return concat("webots:", address.ssl ? "wss://" : "ws://", public_place(address, port));
}

std::string public_http_url(PublicAddress const& address)
{
    return concat(address.ssl ? "https://" : "http://", public_place(address));
}

} // namespace webots_cloud::core
