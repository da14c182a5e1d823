// Another user for a program that we, as root, start.
#pragma once

#include <sys/types.h>

namespace webots_cloud::guard {

/// Who runs the program, and what is arranged for that user before.
struct User
{
    static constexpr int max_groups = 32;

    /// We are root in a user namespace alone, and `user` is one of it.
    bool is_subordinate = false;
    bool is_other = false; ///< False: the program runs as we do, and nothing of this means anything.
    uid_t user = 0;
    gid_t groups[max_groups] = {}; ///< The first is the user's own.
    int group_count = 0;
    /// Becomes the user's with everything in it, and nobody else's. Empty: nothing changes hands.
    char const* folder = nullptr;
    char const* home = nullptr;      ///< Made in `folder`, for `HOME`.
    char const* authority = nullptr; ///< The file of a display's password, copied to `<home>/Xauthority`.
    /// What the user has to reach besides `folder`, even below folders of root's.
    char const* const* visible = nullptr;
    int visible_count = 0;
};

/// Takes `--user UID GID[,GID...] FOLDER HOME AUTHORITY [--visible PATH]...` out of our command line, if it
/// is there. An empty AUTHORITY means that there is none.   Returns: false when it is malformed.
bool take_user(int& argc, char**& argv, User& user);

/// Gives the folder to the user. Nothing of the user's may run yet.   False: `errno` says why not.
bool hand_over(User const& user);

/// In a mount namespace that only we have: makes sure that the user reaches the folder and what is visible. A
/// folder above them that the user may not search is covered by an empty one, in which only these are.
/// False: some of it can't be reached.
bool show_to(User const& user);

/// In a mount namespace that only we have: puts an empty folder that nobody may look into in place of this
/// one. False: `errno` says why not.
bool hide(char const* folder);

/// From now on this process is the user's, and can't become root again.   False: it must not go on.
bool become(User const& user);

} // namespace webots_cloud::guard
