#include "lock_step.hpp"

#include "text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace webots_cloud::demo {
namespace {

/// Takes a blank and a number off the beginning of `rest`.
template<class Number>
bool take_number(std::string_view& rest, Number& number)
{
    if (!rest.starts_with(' '))
        return false;
    rest.remove_prefix(1);
    auto const [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc{})
        return false;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return true;
}

bool take_wheel(std::string_view& rest, WheelDrive& wheel)
{
    if (!take_number(rest, wheel.position) || !take_number(rest, wheel.velocity) ||
        std::isnan(wheel.position) || std::isnan(wheel.velocity))
        return false;
    constexpr double most = robot_model::max_wheel_velocity;
    wheel.velocity = std::clamp(wheel.velocity, -most, most);
    return true;
}

void append(std::string& line, double value)
{
    std::array<char, 32> buffer{};
    auto const end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
    line += ' ';
    line.append(buffer.data(), end);
}

} // namespace

std::optional<StepRequest> parse_step_request(std::string_view line)
{
    constexpr std::string_view word = "step";
    constexpr int longest = 1'000'000'000;
    if (line.size() > max_step_request || !line.starts_with(word))
        return std::nullopt;
    line.remove_prefix(word.size());
    StepRequest request;
    bool const complete = take_number(line, request.duration) && take_wheel(line, request.drive.left) &&
                          take_wheel(line, request.drive.right) && line.empty();
    if (!complete || request.duration < 1 || request.duration > longest)
        return std::nullopt;
    return request;
}

std::string greeting(World const& world, RobotDescription const& robot)
{
    return "robot " + std::to_string(world.time_step) + " " + printable(robot.name, 100);
}

std::string measurements(Arena const& arena, std::size_t index)
{
    Robot const& robot = arena.robots()[index];
    std::string line = std::to_string(arena.time());
    for (double const distance : robot.distances)
        append(line, distance);
    for (double const value : {robot.pose.position.x, robot.pose.position.y, robot.pose.heading,
                               robot.turned.left, robot.turned.right})
        append(line, value);
    return line;
}

bool LockStep::ask(std::size_t robot, std::int64_t now, int duration)
{
    Program& program = programs_[robot];
    if (program.state != State::computes)
        return false;
    program = {State::waits, now + duration};
    return true;
}

bool LockStep::may_step() const
{
    return std::none_of(programs_.begin(), programs_.end(),
                        [](Program const& program) { return program.state == State::computes; });
}

std::vector<std::size_t> LockStep::due(std::int64_t now)
{
    std::vector<std::size_t> robots;
    for (std::size_t i = 0; i < programs_.size(); ++i) {
        if (programs_[i].state != State::waits || programs_[i].until > now)
            continue;
        programs_[i].state = State::computes;
        robots.push_back(i);
    }
    return robots;
}

} // namespace webots_cloud::demo
