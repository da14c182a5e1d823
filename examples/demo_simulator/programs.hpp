// The programs that drive robots: what the simulation needs of them, and what it is told.
#pragma once

#include "lock_step.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

enum class Output
{
    standard,
    error
};

/// Of one robot.
struct Program
{
    std::size_t robot = 0;
    std::string name; ///< of the controller
    std::filesystem::path file;
    ProgramKind kind{};
    std::string greeting;
};

/// What programs do. None is told of a program after others were started.
class ProgramListener
{
public:
    virtual ~ProgramListener() = default;
    virtual void step_requested(std::size_t robot, StepRequest const& request) = 0;
    virtual void program_ended(std::size_t robot) = 0;

    /// A line that a program printed, or one about it.
    virtual void program_printed(std::string const& line, Output output) = 0;
};

class Programs
{
public:
    virtual ~Programs() = default;

    /// Ends those that run, and starts these. One that can't be started has ended.
    virtual void start(std::vector<Program> programs, ProgramListener& listener) = 0;

    /// Sends a line to the program of a robot, if it has one.
    virtual void answer(std::size_t robot, std::string line) = 0;

    /// Ends the program of a robot, which has broken the rules.
    virtual void end(std::size_t robot, std::string const& why) = 0;
};

} // namespace webots_cloud::demo
