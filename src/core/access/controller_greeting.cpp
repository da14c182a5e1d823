// Recognizes the greetings of two generations of libController in the bytes of a stranger.
#include "controller_greeting.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view call_of_controllers = "CTR";
constexpr std::string_view robot_field = "\nRobot-Name: ";
constexpr std::string_view connected = "CONNECTED";

using Greeting = std::optional<ControllerGreeting>;

Failure not_a_controller()
{
    return Failure(errc::protocol_error, "Only controllers of Webots are served at this port.");
}

Failure wrong_path()
{
    return Failure(errc::protocol_error,
                   "The path of WEBOTS_CONTROLLER_URL is not one that a simulation has shown.");
}

/// The byte that a code at the beginning of the text, `%41`, stands for; negative: there is none.
int encoded_byte(std::string_view text) noexcept
{
    if (text.size() < 3 || text[0] != '%' || hex_digit(text[1]) < 0 || hex_digit(text[2]) < 0)
        return -1;
    return 16 * hex_digit(text[1]) + hex_digit(text[2]);
}

bool is_plain(char c) noexcept
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '.' || c == '_' || c == '~';
}

void append_code(std::string& out, unsigned char byte)
{
    constexpr std::string_view digits = "0123456789ABCDEF";
    out.push_back('%');
    out.push_back(digits[byte >> 4]);
    out.push_back(digits[byte & 15]);
}

/// What libController has encoded, as the author wrote it.
std::string decoded(std::string_view name)
{
    std::string text;
    while (!name.empty()) {
        auto const byte = encoded_byte(name);
        text.push_back(byte < 0 ? name.front() : static_cast<char>(byte));
        name.remove_prefix(byte < 0 ? 1 : 3);
    }
    return text;
}

bool has_control_characters(std::string_view text) noexcept
{
    return std::any_of(text.begin(), text.end(),
                       [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

/// Whether `bytes` begins with `mark`; nothing: it may, when more has come.
std::optional<bool> begins_with(std::string_view bytes, std::string_view mark) noexcept
{
    if (bytes.starts_with(mark))
        return true;
    return mark.starts_with(bytes) ? std::nullopt : std::optional(false);
}

/// Takes the slash off that parts a path, as it was written or as libController encodes it.   Nothing: more
/// must come. False: there is something else.
std::optional<bool> take_slash(std::string_view& path, bool& is_encoded)
{
    is_encoded = path.starts_with('%');
    std::string_view const slash = is_encoded ? "%2F" : "/";
    auto const found = begins_with(path, slash);
    if (found && *found)
        path.remove_prefix(slash.size());
    return found;
}

/// `2000/` of `2000/<key>`, if it is there.   As `take_slash`.
std::optional<bool> take_machine(std::string_view& path, std::uint16_t& machine)
{
    auto const size = std::min(path.find_first_not_of("0123456789"), path.size());
    if (size == 0)
        return true;
    machine = parse_port(path.substr(0, size));
    path.remove_prefix(size);
    bool is_encoded = false;
    return machine == 0 ? false : take_slash(path, is_encoded);
}

/// `[<machine>/]<key>[/<robot>]`, or the same as libController encodes it.
result<Greeting> read_path(std::string_view path)
{
    auto const is_key_letter = [](char c) { return c >= 'a' && c <= 'z'; };
    ControllerGreeting greeting;
    auto const has_begun = take_machine(path, greeting.machine);
    if (!has_begun)
        return Greeting();
    auto const key = path.substr(0, controller_key_length);
    if (!*has_begun || !std::all_of(key.begin(), key.end(), is_key_letter))
        return wrong_path();
    if (key.size() < controller_key_length)
        return Greeting();
    greeting.key = key;
    path.remove_prefix(key.size());
    if (path.empty())
        return Greeting(std::move(greeting));
    bool is_encoded = false;
    auto const is_parted = take_slash(path, is_encoded);
    if (!is_parted)
        return Greeting();
    auto const robot = is_encoded ? decoded(path) : std::string(path);
    if (!*is_parted || has_control_characters(decoded(robot)))
        return wrong_path();
    greeting.robot = encoded_robot_name(robot);
    return Greeting(std::move(greeting));
}

} // namespace

result<Greeting> read_controller_greeting(std::string_view bytes)
{
    if (bytes.size() > max_controller_greeting)
        return Failure(errc::too_large, "The first message of this controller is too long.");
    auto const calls = begins_with(bytes, call_of_controllers);
    if (!calls)
        return Greeting();
    if (!*calls)
        return not_a_controller();
    bytes.remove_prefix(call_of_controllers.size());
    auto const has_name = begins_with(bytes, robot_field);
    if (!has_name)
        return Greeting();
    if (!*has_name)
        return not_a_controller();
    bytes.remove_prefix(robot_field.size());
    while (bytes.ends_with('\n')) // of other programs; libController ends with the name
        bytes.remove_suffix(1);
    return read_path(bytes);
}

Failure unfinished_greeting(std::string_view bytes)
{
    if (!bytes.starts_with(call_of_controllers))
        return not_a_controller();
    return Failure(errc::protocol_error, "WEBOTS_CONTROLLER_URL has no key: take the whole address that the "
                                         "console of the simulation shows.");
}

std::string greeting_for(std::string_view name)
{
    return name.empty() ? std::string(call_of_controllers) : concat(call_of_controllers, robot_field, name);
}

std::uint16_t port_of_machine(std::string_view address) noexcept
{
    auto const separator = address.find_last_of(":/");
    return separator == std::string_view::npos ? std::uint16_t{0} : parse_port(address.substr(separator + 1));
}

std::string controller_path(std::string_view key, std::string_view robot)
{
    return robot.empty() ? std::string(key) : concat(key, "/", robot);
}

ControllerAnswer read_controller_answer(std::string_view bytes) noexcept
{
    auto const is_connected = begins_with(bytes, connected);
    if (!is_connected)
        return ControllerAnswer::incomplete;
    return *is_connected ? ControllerAnswer::connected : ControllerAnswer::refused;
}

std::string controller_forbidden(std::string_view sentence)
{
    return concat("FORBIDDEN: ", sentence, "\n");
}

std::string controller_failed(std::string_view sentence)
{
    return concat("FAILED: ", sentence, "\n");
}

std::string encoded_robot_name(std::string_view name)
{
    std::string text;
    while (!name.empty()) {
        auto const byte = encoded_byte(name);
        if (byte < 0 && is_plain(name.front()))
            text.push_back(name.front());
        else
            append_code(text, static_cast<unsigned char>(byte < 0 ? name.front() : byte));
        name.remove_prefix(byte < 0 ? 1 : 3);
    }
    return text;
}

} // namespace webots_cloud::core
