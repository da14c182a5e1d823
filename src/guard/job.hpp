// A program that runs on a node of a cluster: says where that is, on which port it listens and what it uses,
// to the server that reads its output elsewhere.
#pragma once

#include <sys/types.h>

namespace webots_cloud::guard {

struct Job
{
    int first = 0; ///< The ports that it may listen on.
    int last = 0;  ///< 0: it is no job.
    char word[17] = "";
    bool told = false;               ///< On which port it listens.
    long usage_due = 0;              ///< When to say next what it uses, as `now_ms` says.
    bool receives = false;           ///< The program is the one that fills the folder.
    char const* folder = nullptr;    ///< The project is received into it; null: the node sees the server's.
    char const* directory = nullptr; ///< Where the program begins then.
    long measure_due = 0;            ///< Of the folder, as `usage_due`; and what it has shown:
    unsigned long long folder_bytes = 0;
    bool folder_has_too_many = false;
};

/// Takes `--job FIRST LAST [--receive FOLDER DIRECTORY]` out of a command line.   Returns: false when it is
/// malformed.
bool take_job(int& argc, char**& argv, Job& job);

/// Prints on which node we are, in which job, and a word that nobody else knows. Before the program starts,
/// which can't take this line away, nor print another one first. The other lines it never sees: they go to
/// our standard error, which it does not get.
void tell_node(Job& job);

/// Prints a line with the word, at most 250 bytes. Never waits.   Returns: false when nobody reads the lines
/// before it.
bool tell(Job const& job, char const* what);

/// Looks at the tree below `program`, and prints what is new: the lowest port that it listens on (of any
/// process of the machine, if it has a network of its own, since we keep the port for it), and what it uses.
/// While it is the program that receives the project: how far that is.
/// Returns: in how many milliseconds to look again.
int tell_news(Job& job, pid_t program, bool has_own_network);

} // namespace webots_cloud::guard
