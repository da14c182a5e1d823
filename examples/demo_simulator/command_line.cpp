// Reads Webots' command line, also that of R2021b and older, as far as it means something here, and the
// faults that tests ask for.
#include "command_line.hpp"

#include "options.hpp"
#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

namespace webots_cloud::demo {
namespace {

constexpr std::string_view version_text =
    "webots-demo-simulator 1.0: the demo simulator of webots_cloud. This is not Webots.\n";

std::string usage()
{
    std::string text = "Usage: webots-demo-simulator [options] <world.wbt>\n"
                       "\n"
                       "The demo simulator of webots_cloud, for machines without Webots. It takes the\n"
                       "command line of Webots and speaks its streaming protocol, but is not Webots:\n"
                       "a few two-wheeled robots move about in an arena.\n"
                       "\n"
                       "Options that do something:\n";
    for (auto const& option : program_options) {
        std::string const form = std::string(option.name) + option.value;
        text +=
            "  " + form + std::string(form.size() < 28 ? 28 - form.size() : 1, ' ') + option.summary + "\n";
    }
    text += "\nOptions that are accepted and ignored:\n";
    for (auto const& option : ignored_options)
        text += std::string("  ") + option.name + option.value + "\n";
    return text + "\nFaults, separated by commas:\n" + std::string(fault_help());
}

/// Thrown and caught in this file only.
struct Invalid : std::runtime_error
{
    using std::runtime_error::runtime_error;
};

std::optional<int> whole_number(std::string_view text)
{
    int number = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size())
        return std::nullopt;
    return number;
}

unsigned short port_number(std::string_view text)
{
    auto const number = whole_number(text);
    if (!number || *number < 1 || *number > 65535)
        throw Invalid("invalid port '" + printable(text, 40) + "': a number from 1 to 65535 was expected");
    return static_cast<unsigned short>(*number);
}

std::chrono::milliseconds heartbeat_time(std::string_view text)
{
    auto const number = whole_number(text);
    if (!number || *number < 1)
        throw Invalid("invalid heartbeat '" + printable(text, 40) +
                      "': a number of milliseconds was expected");
    return std::chrono::milliseconds{*number};
}

Mode start_mode(std::string_view text)
{
    if (text == "pause" || text == "stop")
        return Mode::pause;
    if (text == "realtime" || text == "run")
        return Mode::real_time;
    if (text == "fast")
        return Mode::fast;
    throw Invalid("invalid mode '" + printable(text, 40) + "': pause, realtime or fast was expected");
}

StreamMode stream_mode(std::string_view text, Faults const& faults)
{
    if (text == "mjpeg")
        return StreamMode::mjpeg;
    if ((text == "w3d" && !faults.refuse_w3d) || (text == "x3d" && !faults.refuse_x3d))
        return StreamMode::scene;
    throw Invalid("invalid stream mode '" + printable(text, 40) + "'");
}

/// `port=2001;monitorActivity;mode=mjpeg;...`, in literal double quotes or without.
void read_old_stream(Options& options, std::string_view text)
{
    std::string inner(text);
    std::erase(inner, '"');
    options.old_protocol = true;
    for (std::size_t begin = 0; begin < inner.size();) {
        std::size_t const end = std::min(inner.find(';', begin), inner.size());
        std::string_view const item = std::string_view(inner).substr(begin, end - begin);
        begin = end + 1;
        if (item.starts_with("port="))
            options.port = port_number(item.substr(5));
        else if (item.starts_with("mode="))
            options.stream = stream_mode(item.substr(5), options.faults);
        else if (item == "controllerEdit")
            options.controller_edit = true;
    }
}

void read_stream(Options& options, std::string_view value)
{
    if (value.find_first_of(";=\"") != std::string_view::npos)
        read_old_stream(options, value);
    else
        options.stream = stream_mode(value, options.faults);
}

Faults faults_from(std::string_view list, Faults already)
{
    auto parsed = parse_faults(list, already);
    if (auto const* problem = std::get_if<std::string>(&parsed))
        throw Invalid(*problem);
    return std::get<Faults>(parsed);
}

bool is_ignored(std::string_view argument)
{
    return std::ranges::any_of(ignored_options, [argument](ProgramOption const& option) {
        std::string_view const name = option.name;
        return argument == name ||
               (*option.value && argument.starts_with(name) && argument.substr(name.size()).starts_with('='));
    });
}

void read_option(Options& options, std::string_view argument)
{
    auto const value_of = [argument](std::string_view name) -> std::optional<std::string_view> {
        return argument.starts_with(name) ? std::optional(argument.substr(name.size())) : std::nullopt;
    };
    if (auto const port = value_of("--port="))
        options.port = port_number(*port);
    else if (auto const stream = value_of("--stream="))
        read_stream(options, *stream);
    else if (auto const mode = value_of("--mode="))
        options.mode = start_mode(*mode);
    else if (auto const beat = value_of("--heartbeat="))
        options.heartbeat = heartbeat_time(*beat);
    else if (auto const address = value_of("--demo-address="))
        options.address = *address;
    else if (argument == "--stdout")
        options.echo_console = true;
    else if (argument == "--extern-urls")
        options.extern_urls = true;
    else if (argument != "--stream" && argument != "--heartbeat" && !is_ignored(argument))
        throw Invalid("invalid option '" + printable(argument, 80) + "'");
}

Refusal refusal(std::string const& problem)
{
    return Refusal{"webots: " + problem + "\nTry 'webots --help' for more information.\n"};
}

Options read_arguments(std::vector<std::string> const& arguments, Environment const& environment)
{
    Options options;
    options.address = environment.address;
    options.faults = faults_from(environment.faults, {});
    for (std::string const& argument : arguments)
        if (argument.starts_with("--demo-faults="))
            options.faults = faults_from(std::string_view(argument).substr(14), options.faults);
    for (std::string const& argument : arguments) {
        if (argument.starts_with("--demo-faults="))
            continue;
        if (argument.starts_with("-"))
            read_option(options, argument);
        else if (options.world.empty())
            options.world = argument;
        else
            throw Invalid("too many arguments: '" + printable(argument, 80) + "'");
    }
    if (options.world.empty())
        throw Invalid("a world file was expected");
    return options;
}

} // namespace

CommandLine parse_command_line(std::vector<std::string> const& arguments, Environment const& environment)
{
    auto const asked_for = [&arguments](std::string_view option) {
        return std::find(arguments.begin(), arguments.end(), option) != arguments.end();
    };
    if (asked_for("--help"))
        return Notice{usage()};
    if (asked_for("--version"))
        return Notice{std::string(version_text)};
    if (asked_for("--sysinfo"))
        return Notice{std::string(version_text) + "System: no display and no graphics card are used.\n"};
    if (!arguments.empty() && arguments.front() == "convert")
        return refusal("the demo simulator cannot convert PROTO files");
    try {
        return read_arguments(arguments, environment);
    } catch (Invalid const& invalid) {
        return refusal(invalid.what());
    }
}

} // namespace webots_cloud::demo
