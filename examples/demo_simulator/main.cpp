#include "command_line.hpp"
#include "console.hpp"
#include "lifecycle.hpp"
#include "process_faults.hpp"

#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>

using namespace webots_cloud::demo;

namespace {

std::string variable(char const* name)
{
    char const* const value = std::getenv(name);
    return value ? value : "";
}

int run(Options const& options)
{
    print_line("demo simulator: this is the demo simulator of webots_cloud, not Webots");
    std::error_code error;
    if (!std::filesystem::is_regular_file(options.world, error)) {
        std::cerr << "webots: could not open file: '" << options.world.string() << "'\n";
        return 1;
    }
    apply_process_faults(options.faults);
    try {
        Lifecycle(options).run();
    } catch (std::exception const& failure) {
        std::cerr << "webots: " << failure.what() << '\n';
        return 1;
    }
    return 0;
}

} // namespace

int main(int argc, char* argv[])
{
    // SIGTERM keeps its default, so that it ends the process at once even while stdout is full.
    std::signal(SIGPIPE, SIG_IGN);
    CommandLine const line = parse_command_line(
        {argv + 1, argv + argc}, {variable("WEBOTS_DEMO_FAULTS"), variable("WEBOTS_DEMO_ADDRESS")});
    if (auto const* notice = std::get_if<Notice>(&line)) {
        std::cout << notice->text;
        return 0;
    }
    if (auto const* refusal = std::get_if<Refusal>(&line)) {
        std::cerr << refusal->text;
        return 1;
    }
    return run(std::get<Options>(line));
}
