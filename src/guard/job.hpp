// A program that runs on a node of a cluster: says where that is, and on which port it listens, to the server
// that reads its output elsewhere.
#pragma once

#include <sys/types.h>

namespace webots_cloud::guard {

struct Job
{
    int first = 0; ///< The ports that it may listen on.
    int last = 0;  ///< 0: it is no job.
    char word[17] = "";
    bool told = false; ///< On which port it listens.
};

/// How often to look for the port.
constexpr int port_interval_ms = 200;

/// Takes `--job FIRST LAST` out of a command line.   Returns: false when it is malformed.
bool take_job(int& argc, char**& argv, Job& job);

/// Prints on which node we are, with a word that nobody else knows. Before the program starts.
void tell_node(Job& job);

/// Looks once, and prints the lowest port that a process of the tree below `program` listens on. 0: any
/// process may, since the program has a network of its own, and we keep the port for it.
void tell_port(Job& job, pid_t program);

} // namespace webots_cloud::guard
