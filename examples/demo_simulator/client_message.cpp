// Reads what browsers say to the simulator, in Webots' texts.
#include "client_message.hpp"

#include <boost/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <sstream>

namespace webots_cloud::demo::message {
namespace {

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && text.front() == ' ')
        text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\n'))
        text.remove_suffix(1);
    return text;
}

std::optional<std::string_view> after(std::string_view text, std::string_view prefix)
{
    return text.starts_with(prefix) ? std::optional(text.substr(prefix.size())) : std::nullopt;
}

template<class Number>
std::optional<Number> number(std::string_view text)
{
    Number value{};
    text = trimmed(text);
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::optional<PictureSize> size(std::string_view text)
{
    auto const cross = text.find('x');
    if (cross == std::string_view::npos)
        return std::nullopt;
    auto const width = number<int>(text.substr(0, cross));
    auto const height = number<int>(text.substr(cross + 1));
    if (!width || !height || *width < 1 || *height < 1)
        return std::nullopt;
    return PictureSize{*width, *height};
}

std::optional<Message> join(std::string_view text)
{
    static constexpr std::array<std::string_view, 3> modes{"x3dom", "x3d", "w3d"};
    for (std::string_view const mode : modes)
        if (auto const rest = after(text, mode); rest && (rest->empty() || rest->front() == ';'))
            return JoinScene{rest->find("broadcast") != std::string_view::npos};
    if (auto const rest = after(text, "mjpeg:"))
        if (auto const asked = size(*rest))
            return JoinPictures{*asked};
    return std::nullopt;
}

std::optional<Message> run(std::string_view text)
{
    for (bool const fast : {false, true})
        if (auto const rest = after(text, fast ? "fast:" : "real-time:"))
            if (auto const duration = number<std::int64_t>(*rest))
                return Run{fast, *duration};
    return std::nullopt;
}

std::optional<Message> mouse(std::string_view text)
{
    auto const rest = after(text, "mouse ");
    if (!rest)
        return std::nullopt;
    std::istringstream stream{std::string(*rest)};
    stream.imbue(std::locale::classic());
    Mouse mouse;
    int button = 0;
    int modifiers = 0;
    if (!(stream >> mouse.type >> button >> mouse.buttons >> mouse.x >> mouse.y >> modifiers))
        return std::nullopt;
    stream >> mouse.wheel; // absent in the messages of older clients
    return mouse;
}

std::optional<Message> to_robot(std::string_view text)
{
    auto const rest = after(text, "robot:");
    if (!rest)
        return std::nullopt;
    if (rest->starts_with("{")) {
        boost::json::error_code error;
        boost::json::value const value =
            boost::json::parse(boost::json::string_view(rest->data(), rest->size()), error);
        auto const* const object = error ? nullptr : value.if_object();
        auto const* const name = object ? object->if_contains("name") : nullptr;
        auto const* const message = object ? object->if_contains("message") : nullptr;
        if (!name || !message || !name->is_string() || !message->is_string())
            return std::nullopt;
        return ToRobot{std::string(name->get_string()), std::string(message->get_string())};
    }
    auto const colon = rest->find(':');
    if (colon == std::string_view::npos)
        return std::nullopt;
    std::string_view const message = rest->substr(colon + 1);
    if (message == "init robot window")
        return Ignored{};
    return ToRobot{std::string(rest->substr(0, colon)), std::string(message)};
}

std::optional<Message> editor(std::string_view text)
{
    if (auto const name = after(text, "get controller:"))
        return GetController{std::string(*name), {}};
    auto rest = after(text, "sync controller:");
    bool const is_question = rest.has_value();
    if (!is_question)
        rest = after(text, "set controller:");
    if (!rest)
        return std::nullopt;
    auto const slash = rest->find('/');
    if (slash == std::string_view::npos)
        return std::nullopt;
    auto const name = rest->substr(0, slash);
    auto const file = rest->substr(slash + 1);
    if (is_question)
        return GetController{std::string(name), std::string(file)};
    auto const newline = file.find('\n');
    auto const colon = file.substr(0, newline).rfind(':');
    if (newline == std::string_view::npos || colon == std::string_view::npos ||
        !number<std::int64_t>(file.substr(colon + 1, newline - colon - 1)))
        return std::nullopt;
    return SetController{std::string(name), std::string(file.substr(0, colon)),
                         std::string(file.substr(newline + 1))};
}

bool is_known_without_effect(std::string_view text)
{
    static constexpr std::array<std::string_view, 2> prefixes{"touch ", "follow: "};
    return std::any_of(prefixes.begin(), prefixes.end(),
                       [text](std::string_view p) { return text.starts_with(p); });
}

std::optional<Message> parameterless(std::string_view text)
{
    if (text == "pause")
        return Pause{};
    if (text == "step")
        return Step{};
    if (text == "reset")
        return Reset{};
    if (text == "reload" || text == "revert")
        return Reload{};
    return std::nullopt;
}

} // namespace

Message parse(std::string_view text)
{
    for (auto const parser : {parameterless, join, run, mouse, to_robot, editor})
        if (auto message = parser(text))
            return *std::move(message);
    if (auto const rest = after(text, "timeout:"))
        if (auto const duration = number<std::int64_t>(*rest))
            return Timeout{*duration};
    if (auto const rest = after(text, "resize:"))
        if (auto const asked = size(*rest))
            return Resize{*asked};
    if (auto const rest = after(text, "load:"))
        return Load{std::string(rest->substr(rest->find_last_of("/\\") + 1))};
    if (is_known_without_effect(text))
        return Ignored{};
    return Unsupported{};
}

} // namespace webots_cloud::demo::message
