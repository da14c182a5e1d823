// Programs and the simulation move in lock-step: a program says for how long its robot shall do something,
// and gets the measurements when that much time is simulated; time stands while a program computes. So the
// same program always gets the same result, however slow the machine is. Decisions alone, no I/O.
#pragma once

#include "arena.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

/// The longest line that a program may send.
inline constexpr std::size_t max_step_request = 256;

struct StepRequest
{
    int duration = 0; ///< Milliseconds, 1 to 10^9.
    Drive drive;
};

/// Reads `step <ms> <left position> <left velocity> <right position> <right velocity>`; velocities are cut
/// to what the motors can do.
std::optional<StepRequest> parse_step_request(std::string_view line);

/// The first line that a program gets: `robot <basic time step> <name>`.
std::string greeting(World const& world, RobotDescription const& robot);

/// What it gets after each step: `<ms> <distance>... <x> <y> <heading> <left angle> <right angle>`.
std::string measurements(Arena const& arena, std::size_t robot);

/// For whom time waits.
class LockStep
{
public:
    /// Starts anew with this number of robots; none has a program.
    void reset(std::size_t robots) { programs_.assign(robots, Program{}); }

    /// The robot's program starts: it is waited for.
    void begin(std::size_t robot) { programs_[robot].state = State::computes; }

    /// It asks to be answered once `duration` has passed. False: it is not its turn.
    bool ask(std::size_t robot, std::int64_t now, int duration);

    /// It has ended.
    void end(std::size_t robot) { programs_[robot].state = State::absent; }

    bool may_step() const;

    /// Whose time has come. They compute from now on.
    std::vector<std::size_t> due(std::int64_t now);

private:
    enum class State
    {
        absent,
        computes,
        waits
    };

    struct Program
    {
        State state = State::absent;
        std::int64_t until = 0; ///< When it waits.
    };

    std::vector<Program> programs_;
};

} // namespace webots_cloud::demo
