// The controllers of a project on disk: which programs the robots have, and what an editor reads and
// saves. Names come from worlds and browsers, so none may lead out of its folder.
#include "controller_files.hpp"

#include "text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>

namespace webots_cloud::demo {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_files = 20;
constexpr std::size_t max_controller_file = std::size_t{1} << 18;

/// Simulations run what others have written: a name must not lead anywhere else.
bool is_plain_name(std::string_view name)
{
    return !name.empty() && name.size() <= 100 && name.front() != '.' &&
           name.find_first_of(std::string_view("/\\\0", 3)) == std::string_view::npos;
}

fs::path folder_of(fs::path const& world_file, std::string const& controller)
{
    return world_file.parent_path().parent_path() / "controllers" / controller;
}

/// A file descriptor that closes itself.
class Descriptor
{
public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor()
    {
        if (number_ >= 0)
            ::close(number_);
    }
    Descriptor(Descriptor const&) = delete;
    Descriptor& operator=(Descriptor const&) = delete;

    int number() const { return number_; }

    bool is_regular_file() const
    {
        struct stat status
        {};
        return number_ >= 0 && ::fstat(number_, &status) == 0 && S_ISREG(status.st_mode);
    }

private:
    int number_;
};

std::optional<std::string> read_text(fs::path const& path)
{
    Descriptor const file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!file.is_regular_file())
        return std::nullopt;
    std::string text(max_controller_file + 1, '\0');
    std::size_t size = 0;
    for (;;) {
        auto const got = ::read(file.number(), text.data() + size, text.size() - size);
        if (got < 0 || size + static_cast<std::size_t>(got) > max_controller_file)
            return std::nullopt;
        if (got == 0)
            break;
        size += static_cast<std::size_t>(got);
    }
    text.resize(size);
    return is_utf8(text) ? std::optional(std::move(text)) : std::nullopt;
}

/// The number of `CRUISE = <number>`, a comment after it or none; 0 digits: nothing.
std::optional<double> cruise_of(std::string_view line)
{
    auto const skip_blanks = [&line] {
        line.remove_prefix(std::min(line.size(), line.find_first_not_of(" \t")));
    };
    line.remove_prefix(std::strlen("CRUISE"));
    skip_blanks();
    if (!line.starts_with('='))
        return std::nullopt;
    line.remove_prefix(1);
    skip_blanks();
    double number = 0;
    auto const [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
    if (error != std::errc{})
        return std::nullopt;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    skip_blanks();
    return line.empty() || line.front() == '#' || line.front() == '\r' ? std::optional(number) : std::nullopt;
}

double read_cruise(World& world, fs::path const& world_file, std::string const& controller)
{
    if (!is_plain_name(controller))
        return default_cruise;
    auto const name = controller + ".py";
    auto const text = read_text(folder_of(world_file, controller) / name);
    if (!text)
        return default_cruise;
    std::string_view rest = *text;
    while (!rest.empty()) {
        auto const line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(rest.size(), line.size() + 1));
        if (!line.starts_with("CRUISE") || line.find_first_of(" \t=") != std::strlen("CRUISE"))
            continue;
        if (auto const number = cruise_of(line))
            return std::clamp(*number, -max_cruise, max_cruise);
        world.warnings.push_back(printable(name) + ": the demo simulator expected a number in \"" +
                                 printable(line, 80) + "\"");
        break;
    }
    return default_cruise;
}

bool is_file(fs::path const& path)
{
    std::error_code error;
    return fs::is_regular_file(fs::symlink_status(path, error)); // no link: it could lead out of the project
}

/// Any source in the folder of a controller: its program is made of all of them.
std::optional<fs::path> find_source(fs::path const& folder)
{
    constexpr int most_looked_at = 1000;
    std::error_code error;
    fs::directory_iterator entry(folder, error);
    for (int i = 0; !error && entry != fs::directory_iterator() && i < most_looked_at;
         ++i, entry.increment(error)) {
        auto const ending = entry->path().extension();
        if ((ending == ".c" || ending == ".cpp" || ending == ".cc" || ending == ".cxx") && is_file(*entry))
            return entry->path();
    }
    return std::nullopt;
}

void find_program(RobotDescription& robot, fs::path const& folder)
{
    auto const name = folder / robot.controller;
    auto const take = [&robot](fs::path file, ProgramKind kind) {
        robot.program = std::move(file);
        robot.program_kind = kind;
    };
    if (is_file(name) && ::access(name.c_str(), X_OK) == 0)
        take(name, ProgramKind::executable);
    else if (auto python = fs::path(name) += ".py"; is_file(python))
        take(std::move(python), ProgramKind::python);
    else if (auto source = find_source(folder))
        take(*std::move(source), ProgramKind::source);
}

} // namespace

std::vector<ControllerFile> controller_files(fs::path const& world_file, std::string const& controller)
{
    std::vector<ControllerFile> files;
    if (!is_plain_name(controller))
        return files;
    std::error_code error;
    std::vector<std::string> names;
    auto const folder = folder_of(world_file, controller);
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end && names.size() < max_files;
         entry.increment(error))
        names.push_back(entry->path().filename().string());
    auto const is_main = [&](std::string const& name) { return name.starts_with(controller + "."); };
    std::sort(names.begin(), names.end(), [&](std::string const& left, std::string const& right) {
        return is_main(left) != is_main(right) ? is_main(left) : left < right;
    });
    for (auto& name : names) {
        if (!is_plain_name(name) || !is_utf8(name) || name == "runtime.ini" ||
            name.find(':') != std::string::npos)
            continue;
        if (auto text = read_text(folder / name))
            files.push_back({std::move(name), *std::move(text)});
    }
    return files;
}

std::string save_controller_file(fs::path const& world_file, std::string const& controller,
                                 std::string const& file, std::string_view content)
{
    auto const named = printable(controller + "/" + file, 100);
    if (!is_plain_name(controller) || !is_plain_name(file))
        return "no file of a controller: " + named;
    if (content.size() > max_controller_file)
        return "larger than 256 KiB: " + named;
    std::error_code error;
    auto const folder = folder_of(world_file, controller);
    if (!fs::is_directory(fs::symlink_status(folder, error)))
        return "there is no such controller: " + named;
    auto const path = folder / file;
    Descriptor const target(
        ::open(path.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644));
    if (!target.is_regular_file() || ::ftruncate(target.number(), 0) != 0)
        return "can't be written: " + named;
    while (!content.empty()) {
        auto const written = ::write(target.number(), content.data(), content.size());
        if (written <= 0)
            return "could not be written: " + named;
        content.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
}

void find_programs(World& world, fs::path const& world_file)
{
    for (auto& robot : world.robots) {
        robot.program.clear();
        if (!robot.may_be_programmed || !is_plain_name(robot.controller))
            continue;
        find_program(robot, folder_of(world_file, robot.controller));
    }
}

void read_cruise(World& world, fs::path const& world_file)
{
    std::map<std::string, double> known;
    for (auto& robot : world.robots) {
        if (!robot.program.empty())
            continue;
        auto const [entry, is_new] = known.emplace(robot.controller, default_cruise);
        if (is_new)
            entry->second = read_cruise(world, world_file, robot.controller);
        robot.cruise = entry->second;
    }
}

} // namespace webots_cloud::demo
