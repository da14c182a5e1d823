// The project of a job on a node that does not see the server's folders: `tar` packs it on the server's
// machine, Slurm passes that on as the job's input, and `tar` unpacks it on the node, into a folder of the
// job's own.
#pragma once

namespace webots_cloud::guard {

/// Takes `--send COUNT PATH...` out of a command line; the paths are absolute.   Returns: their number; 0:
/// none; -1: it is malformed. They lie where the option was.
int take_sent(int& argc, char**& argv);

/// In the process that becomes the program: gives it what `tar` makes of these files and folders as standard
/// input. If that fails the program is ended, and a line says so.   False: `errno`.
bool send_files(char const* const* paths, int count);

/// The folder of a job. As long as this lives it is locked, so that whoever finds it unlocked knows that its
/// guard was killed, and removes it.
class JobFolder
{
public:
    JobFolder() = default;
    JobFolder(JobFolder const&) = delete;
    ~JobFolder() { remove(); }

    /// Makes the folder, which must not exist, and removes those beside it whose guards were killed: they are
    /// ours, and their names have the same beginning, up to the first dot.   False: `errno`.
    bool make(char const* path);

    /// Removes it with all that is in it, once no process of the job is left.
    void remove();

private:
    int parent_ = -1;
    int lock_ = -1; ///< The open folder.
    char const* name_ = nullptr;
};

/// Unpacks standard input into the folder by `tar`, and exits, with 0 when all has come: the sender has
/// closed its end. What is in the folder belongs to us, with modes that our umask allows.
[[noreturn]] void receive_files(char const* folder);

} // namespace webots_cloud::guard
