// Work in folders of a simulation that runs as a subordinate user, which the server itself can't do: for a
// guard in the user namespace of that user.
#pragma once

namespace webots_cloud::guard {

/// What lies in a folder.
struct Measured
{
    bool is_done() const { return bytes > enough || too_many; }

    unsigned long long enough = ~0ULL; ///< It is not counted any further.
    unsigned long long bytes = 0;
    unsigned long long files = 0;
    bool too_many = false; ///< Files, or folders in each other.
};

/// Measures the folder, at least until there are more than `enough` bytes.
Measured measured(char const* folder, unsigned long long enough);

/// Removes the folder `name` in `parent`, whatever modes and depths are in there. Links are not followed.
/// Nothing may work in it any more.   False: `errno` says why something is left.
bool remove_folder(int parent, char const* name);

/// The folder and all folders in it become ours, so that the server can remove everything in them. Of what a
/// simulation has put in there, links are not followed, and files stay what they are. Nothing of the
/// simulation's may run any more.   False: `errno` says why not.
bool take_back(char const* folder);

/// Prints how many bytes lie in the folder, at least if there are more than `enough`; 1 if there are too many
/// files; and the bytes that are free on its disk. As `FolderMeter` says.   Returns: the exit status.
int measure(char const* folder, char const* enough);

/// Copies the file of that name (with folders, as in `a/b`), and its mode, from one folder to another, below
/// which a simulation works meanwhile. It then belongs to the owner of the folder that it is put into.
/// Returns: the exit status; a reason is printed.
int put(char const* from, char const* to, char const* name);

} // namespace webots_cloud::guard
