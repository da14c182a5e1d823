// Starts a program of the project, and the ends of the pipes and of the socket to it. On Linux it dies with
// the simulator, whatever that dies of.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace webots_cloud::demo {

/// A file descriptor that closes itself.
class OpenFile
{
public:
    explicit OpenFile(int number = -1) : number_(number) {}
    OpenFile(OpenFile&& other) noexcept : number_(other.release()) {}
    OpenFile& operator=(OpenFile&& other) noexcept;
    ~OpenFile();

    int number() const { return number_; }
    int release();

private:
    int number_;
};

struct ProgramProcess
{
    pid_t id = -1; ///< also of its process group
    OpenFile steps;
    OpenFile output;
    OpenFile errors;
};

/// `python3` of the PATH.
std::optional<std::string> find_python();

/// Starts the program in its folder. Throws std::system_error.
ProgramProcess start_python(std::string const& python, std::filesystem::path const& program);

/// The same of a file that the machine executes.
ProgramProcess start_executable(std::filesystem::path const& program);

/// The status of a process that has ended, in words: "exited with status 1", "was ended by signal 9
/// (Killed)".
std::string ending(int status);

} // namespace webots_cloud::demo
