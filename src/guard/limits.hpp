// Keeps a program within limits: control groups that the server has made, and limits of its processes.
#pragma once

namespace webots_cloud::guard {

/// What a program may use. Numbers: 0 is no limit.
struct Limits
{
    static constexpr int max_groups = 4;

    int groups[max_groups] = {-1, -1, -1, -1}; ///< Files that move who writes to them into a control group.
    char const* folders[max_groups] = {};      ///< Of these groups.
    unsigned long long data = 0;               ///< Bytes that each process may have of its own.
    unsigned long long processes = 0;          ///< Where that does not count those of other simulations.
    unsigned long long files = 0;              ///< That each process may have open.
    unsigned long long file_size = 0;          ///< Bytes.
};

/// Takes `--group FOLDER` and `--limit NAME NUMBER`, any number of each, out of a command line.
/// Returns: false when they are malformed.
bool take_limits(int& argc, char**& argv, Limits& limits);

/// Outside of the namespaces, where their files are found.   False: `errno` says why not.
bool open_groups(Limits& limits);

/// Both in the process that then executes the program: its groups, which a user other than the server may not
/// enter, and its limits.   False: `errno` says why not, and it must not run.
bool enter_groups(Limits const& limits);
bool set_limits(Limits const& limits);

/// When no process is left in them, and the server, which else does it, is gone.
void remove_groups(Limits const& limits);

} // namespace webots_cloud::guard
