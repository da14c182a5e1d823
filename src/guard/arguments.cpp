// Options stand in the order of the usage, since the server alone writes them. Each function takes its own
// out of the command line, which then begins with the next.
#include "arguments.hpp"

#include "job_folder.hpp"
#include "limits.hpp"
#include "options.hpp"
#include "user.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace webots_cloud::guard {
namespace {

/// Takes an option with one word out of our command line.   Returns: the word, or null.
char const* take_word(int& argc, char**& argv, char const* option)
{
    if (argc < 2 || !take_option(argc, argv, option))
        return nullptr;
    --argc;
    return *argv++;
}

/// Takes the options of the network out of our command line.   Returns: false when they are malformed.
bool take_network(int& argc, char**& argv, Network& network)
{
    using Reach = Network::Reach;
    if (!take_option(argc, argv, "--network"))
        return true;
    bool const none = take_option(argc, argv, "none");
    if (!none && !take_option(argc, argv, "internet"))
        return false;
    int const words = none ? 1 : 4;
    if (argc < words)
        return false;
    network.reach = none ? Reach::none : Reach::internet;
    network.port = std::atoi(argv[0]);
    if (!none) {
        network.slirp = argv[1];
        network.ip = argv[2];
        network.rules = argv[3];
    }
    argc -= words;
    argv += words;
    network.broker = take_word(argc, argv, "--broker");
    return true;
}

/// Takes the options of a container out of our command line.   Returns: false when they are malformed.
bool take_container(int& argc, char**& argv, Container& container)
{
    if (!take_option(argc, argv, "--container"))
        return true;
    if (argc < 2)
        return false;
    container.docker = argv[0];
    container.label = argv[1];
    argc -= 2;
    argv += 2;
    return true;
}

/// Takes the folders that must not be changed out of our command line.   Returns: their number; they lie
/// where the first `--read-only` was.
int take_read_only(int& argc, char**& argv)
{
    char** const folders = argv;
    int count = 0;
    while (argc > 1 && take_option(argc, argv, "--read-only")) {
        folders[count++] = argv[0];
        --argc;
        ++argv;
    }
    return count;
}

/// The same for the files that the program gets open.   Returns: the number of pairs.
int take_opened(int& argc, char**& argv)
{
    char** const pairs = argv;
    int count = 0;
    while (argc > 2 && take_option(argc, argv, "--open")) {
        pairs[2 * count] = argv[0];
        pairs[2 * count + 1] = argv[1];
        ++count;
        argc -= 2;
        argv += 2;
    }
    return count;
}

} // namespace

char** take_cleanup_command(int& argc, char**& argv)
{
    --argc;
    ++argv;
    if (argc < 2 || std::strcmp(argv[0], "--cleanup") != 0)
        return nullptr;
    int const count = std::atoi(argv[1]);
    if (count < 1 || count > argc - 2)
        return nullptr;
    for (int i = 0; i < count; ++i)
        argv[i] = argv[i + 2];
    argv[count] = nullptr; // where COUNT was, or a word that has moved
    char** const cleanup_command = argv;
    argc -= count + 2;
    argv += count + 2;
    return cleanup_command;
}

bool take_option(int& argc, char**& argv, char const* option)
{
    bool const given = argc > 0 && std::strcmp(argv[0], option) == 0;
    argc -= given ? 1 : 0;
    argv += given ? 1 : 0;
    return given;
}

bool take_program(int& argc, char**& argv, Program& program)
{
    program.sent = argv;
    program.sent_count = take_sent(argc, argv);
    // srun kills the job at SIGTERM, guard and all; this one it passes on.
    program.end_signal = program.sent_count > 0 ? SIGUSR1 : SIGTERM;
    program.set_user_id = take_option(argc, argv, "--set-user-id");
    bool const understood =
        take_network(argc, argv, program.network) && take_limits(argc, argv, program.limits);
    bool const has_container = take_container(argc, argv, program.container);
    program.own_sandbox = take_word(argc, argv, "--own-sandbox");
    program.own_displays = take_option(argc, argv, "--own-displays");
    program.opened = argv;
    program.opened_count = take_opened(argc, argv);
    bool const user_understood = take_user(argc, argv, program.user);
    program.read_only = argv;
    program.read_only_count = take_read_only(argc, argv);
    program.argv = argv + 1;
    bool const is_of_somebody = program.user.is_other || !program.user.is_subordinate;
    return program.sent_count >= 0 && understood && has_container && user_understood && is_of_somebody;
}

void explain(std::FILE* file)
{
    char const* before = "Usage:";
    for (char const* const form : forms) {
        std::fprintf(file, "%-6s %s %s\n", before, program_invocation_short_name, form);
        before = "";
    }
    std::fprintf(file, "\nwebots-simulation-server starts it for each simulation: it runs one program, and\n"
                       "ends all that this has started. People need --probe alone.\n\nOptions:\n");
    for (auto const& option : options)
        std::fprintf(file, "  --%s%s%s\n        %s\n", option.name, *option.value ? " " : "", option.value,
                     option.summary);
    std::fprintf(file, "\nSIGTERM, SIGINT and SIGHUP ask the program to end, as a byte on standard input\n"
                       "does; its end kills the whole tree. The exit status is that of the program;\n"
                       "127: it could not be started.\n");
}

int refuse_arguments()
{
    std::fprintf(stderr,
                 "%s: these arguments are not understood. webots-simulation-server starts this program; "
                 "--help says how.\n",
                 program_invocation_short_name);
    return 2;
}

} // namespace webots_cloud::guard
