// Runs the programs of robots, Python and what is compiled: their processes, what they print, and the socket
// over which each asks for steps. Never waits for a program. What one prints is read at a bounded speed, so
// that one that prints without end waits for us, rather than that browsers are flooded.
#pragma once

#include "programs.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include <sys/types.h>

#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace webots_cloud::demo {

class RobotPrograms : public Programs
{
public:
    static constexpr int lines_per_second = 100; ///< of what one program prints to each of stdout and stderr

    explicit RobotPrograms(boost::asio::io_context& context);
    ~RobotPrograms() override;

    void start(std::vector<Program> programs, ProgramListener& listener) override;
    void answer(std::size_t robot, std::string line) override;
    void end(std::size_t robot, std::string const& why) override;

private:
    class Running;

    void start_all();
    void start_one(Program program);
    void end_all();
    void wait_for_children();
    void reap();

    boost::asio::io_context& context_;
    boost::asio::signal_set children_;
    boost::asio::steady_timer start_timer_;
    std::chrono::steady_clock::time_point next_start_{};
    std::vector<Program> programs_; ///< to be started
    ProgramListener* listener_ = nullptr;
    std::map<std::size_t, std::shared_ptr<Running>> running_; ///< by robot
    std::set<pid_t> ending_;                                  ///< killed, and not gone yet
};

} // namespace webots_cloud::demo
