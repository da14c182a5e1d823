// Starts one process with its pipes: a program of the project, or Python with one. robot_programs.cpp decides
// when.
#include "program_process.hpp"

#include "controller_module.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace webots_cloud::demo {
namespace {

constexpr int first_unused = 4; ///< stdin, stdout, stderr and the socket are before it

int checked(int result, char const* what)
{
    if (result < 0)
        throw std::system_error(errno, std::generic_category(), what);
    return result;
}

/// What Python reads on its stdin. A file in memory: a pipe may be too small for it.
OpenFile module_on_stdin()
{
    OpenFile file(checked(::memfd_create("controller.py", MFD_CLOEXEC), "memfd_create"));
    std::string_view const text = controller_module;
    if (::write(file.number(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
        throw std::system_error(ENOSPC, std::generic_category(), "memfd");
    checked(static_cast<int>(::lseek(file.number(), 0, SEEK_SET)), "lseek");
    return file;
}

std::pair<OpenFile, OpenFile> new_pipe()
{
    int ends[2];
    checked(::pipe2(ends, O_CLOEXEC), "pipe2");
    std::pair<OpenFile, OpenFile> pipe{OpenFile(ends[0]), OpenFile(ends[1])};
    checked(::fcntl(ends[0], F_SETFL, O_NONBLOCK), "fcntl");
    return pipe;
}

std::pair<OpenFile, OpenFile> new_socket_pair()
{
    int ends[2];
    checked(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), "socketpair");
    return {OpenFile(ends[0]), OpenFile(ends[1])};
}

struct Child
{
    int files[first_unused]; ///< which become 0, 1, 2, 3
    char const* folder;
    char* const* arguments;
    pid_t parent;
};

/// Between fork and exec: nothing but system calls.
[[noreturn]] void become_program(Child child)
{
    constexpr int out_of_the_way = 10;
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    std::signal(SIGPIPE, SIG_DFL);
    bool ready = ::getppid() == child.parent && ::chdir(child.folder) == 0;
    for (int& file : child.files)
        ready = ready && (file = ::fcntl(file, F_DUPFD, out_of_the_way)) >= 0;
    for (int i = 0; i < first_unused; ++i)
        ready = ready && ::dup2(child.files[i], i) == i;
    // Sockets of the simulator, which are not closed by themselves.
    if (ready && ::close_range(first_unused, ~0U, 0) != 0)
        for (int file = first_unused; file < 4096; ++file)
            ::close(file);
    if (ready) {
        ::execv(child.arguments[0], child.arguments);
        // The simulator reads it as the program's last words.
        std::string_view const why = ::strerrordesc_np(errno);
        [[maybe_unused]] auto const told = ::write(STDERR_FILENO, why.data(), why.size());
    }
    ::_exit(127);
}

/// Starts it in the folder, where `words` are its file and its arguments.
ProgramProcess start_process(std::vector<std::string> words, std::filesystem::path const& folder, OpenFile in)
{
    auto [output, write_output] = new_pipe();
    auto [errors, write_errors] = new_pipe();
    auto [ours, theirs] = new_socket_pair();
    std::vector<char*> arguments;
    for (auto& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    Child const child{{in.number(), write_output.number(), write_errors.number(), theirs.number()},
                      folder.c_str(),
                      arguments.data(),
                      ::getpid()};
    pid_t const id = checked(::fork(), "fork");
    if (id == 0)
        become_program(child);
    ::setpgid(id, id); // whoever comes first
    return {id, std::move(ours), std::move(output), std::move(errors)};
}

} // namespace

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept
{
    std::swap(number_, other.number_);
    return *this;
}

OpenFile::~OpenFile()
{
    if (number_ >= 0)
        ::close(number_);
}

int OpenFile::release()
{
    return std::exchange(number_, -1);
}

std::optional<std::string> find_python()
{
    char const* const path = std::getenv("PATH");
    std::string_view rest = path && *path ? path : "/usr/local/bin:/usr/bin:/bin";
    while (!rest.empty()) {
        auto const folder = rest.substr(0, rest.find(':'));
        rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
        auto program = std::string(folder) + "/python3";
        if (folder.starts_with('/') && ::access(program.c_str(), X_OK) == 0)
            return program;
    }
    return std::nullopt;
}

ProgramProcess start_python(std::string const& python, std::filesystem::path const& program)
{
    // Unbuffered, without files of compiled modules in the project, and with UTF-8 in every locale.
    return start_process({python, "-u", "-B", "-X", "utf8", "-", program.filename().string()},
                         program.parent_path(), module_on_stdin());
}

ProgramProcess start_executable(std::filesystem::path const& program)
{
    return start_process({program.string()}, program.parent_path(),
                         OpenFile(checked(::open("/dev/null", O_RDONLY | O_CLOEXEC), "/dev/null")));
}

std::string ending(int status)
{
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return "exited successfully";
    if (WIFEXITED(status))
        return "exited with status " + std::to_string(WEXITSTATUS(status));
    int const signal = WTERMSIG(status);
    return "was ended by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
}

} // namespace webots_cloud::demo
