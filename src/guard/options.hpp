// The options of the guard, for its usage text and its manual page. They are the servers' affair, and change
// with them: no stable interface.
#pragma once

namespace webots_cloud::guard {

/// A way to call the guard: what follows its name.
inline constexpr char const* forms[] = {
    "[OPTION]... GRACE_MS PROGRAM [ARGUMENT...]",
    "--display SERVER LIMIT_MS [PROGRAM [ARGUMENT...]]",
    "--probe [--read-only FOLDER]...",
    "--filter PROGRAM [ARGUMENT...]",
    "--try FILE PORT PROCESS",
    "--make-users NEWUIDMAP NEWGIDMAP USER GROUP COUNT",
    "--pin-users FOLDER | --unpin-users FOLDER",
    "--subordinate --take-back FOLDER",
    "--subordinate --measure FOLDER ENOUGH",
    "[--subordinate] --put FROM TO FILE",
};

struct Option
{
    char const* name;  ///< Without dashes.
    char const* value; ///< What follows it; empty: nothing does.
    char const* summary;
};

inline constexpr Option options[] = {
    {"broker", "SOCKET", "with --network: hand out connections to the program at this Unix socket"},
    {"cleanup", "COUNT WORD...", "run this command, COUNT words, when no process is left"},
    {"container", "DOCKER PROJECT SERVICE", "the program is compose: give its container the network"},
    {"display", "SERVER LIMIT_MS", "start an X server and the program on it; without one, try the X server"},
    {"filter", "", "forbid the program some system calls"},
    {"group", "FOLDER", "put the program into this control group"},
    {"help", "", "show this text"},
    {"job", "FIRST LAST", "as a job of a cluster: say where, and which of these ports it listens on"},
    {"limit", "NAME NUMBER", "data, file-size, files or processes: what each process may use"},
    {"make-users", "NEWUIDMAP NEWGIDMAP USER GROUP COUNT",
     "make a user namespace of COUNT users of /etc/subuid, from USER on"},
    {"measure", "FOLDER ENOUGH", "with --subordinate: print how large this folder is, up to ENOUGH bytes"},
    {"network", "none PORT | internet PORT SLIRP IP RULES",
     "give the program its own network, and relay connections to PORT into it"},
    {"open", "NUMBER FILE", "open FILE for the program, as its descriptor NUMBER"},
    {"own-displays", "", "hide X servers of the program and of the machine from each other"},
    {"own-sandbox", "FOLDER", "the program makes a sandbox itself, and keeps its files in FOLDER"},
    {"pin-users", "FOLDER", "as root: pin a user namespace for FOLDER's owner to FOLDER.users"},
    {"probe", "", "say how well this machine can keep simulations apart"},
    {"put", "FROM TO FILE", "replace FILE in the folder TO by that of FROM"},
    {"read-only", "FOLDER", "the program can't change this folder"},
    {"receive", "FOLDER DIRECTORY", "after --job: unpack standard input into FOLDER, and start in DIRECTORY"},
    {"send", "COUNT PATH...", "give the program these paths as standard input, packed by tar"},
    {"set-user-id", "", "let programs that run as another user work"},
    {"subordinate", "", "run the program as a user of the namespace at descriptor 3"},
    {"take-back", "FOLDER", "with --subordinate: make this folder, and all in it, ours again"},
    {"try", "FILE PORT PROCESS", "in a sandbox: say what is possible there that should not be"},
    {"unpin-users", "FOLDER", "as root: remove that file"},
    {"user", "UID GID[,GID...] FOLDER HOME AUTHORITY",
     "run the program as another user, to whom FOLDER is given"},
    {"visible", "PATH", "with --user: the user has to reach this"},
};

} // namespace webots_cloud::guard
