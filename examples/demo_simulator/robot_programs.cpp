// Starts the programs of robots with their world, reads what they print and ask for, and ends them. The
// steps that they ask for are taken together (lock_step.hpp).
#include "robot_programs.hpp"

#include "printed_lines.hpp"
#include "program_process.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/read_until.hpp>

#include <sys/wait.h>

#include <array>
#include <csignal>
#include <exception>
#include <system_error>
#include <utility>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

/// Between two starts: a browser may ask for resets as fast as it likes.
constexpr std::chrono::milliseconds start_pause{100};
constexpr std::chrono::seconds patience{2}; ///< until people are told that the simulation waits
constexpr std::size_t last_words = std::size_t{1} << 16;

std::string quoted_name(Program const& program)
{
    return "'" + program.name + "' controller";
}

/// Why it can't run, in a sentence; empty: it can.
std::string what_is_missing(Program const& program, bool has_python)
{
    if (program.kind == ProgramKind::source)
        return "WARNING: " + quoted_name(program) +
               " is not compiled yet, so its robot stands: press Run in the editor, which compiles it where "
               "this machine can.";
    if (program.kind == ProgramKind::python && !has_python)
        return "ERROR: " + quoted_name(program) +
               " needs Python, and this machine has no python3 in its PATH: install it, then reset the "
               "simulation. The robot stands.";
    return {};
}

/// True when the process has ended, which is not reaped by that.
bool has_ended(pid_t id)
{
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(id), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           info.si_pid == id;
}

/// With all that it has started. Its id must not have been reaped: it could be another's by now.
void kill_group(pid_t id)
{
    ::kill(-id, SIGKILL);
    ::kill(id, SIGKILL); // in case it has no group yet
}

} // namespace

class RobotPrograms::Running : public std::enable_shared_from_this<Running>
{
public:
    Running(asio::io_context& context, Program program, ProgramProcess process, ProgramListener& listener)
        : program_(std::move(program)), id_(process.id), listener_(listener),
          steps_(context, asio::local::stream_protocol(), process.steps.release()), waiting_(context),
          output_(context, process.output.release(), Output::standard),
          errors_(context, process.errors.release(), Output::error)
    {
        steps_.non_blocking(true);
    }

    pid_t id() const { return id_; }

    void begin()
    {
        answer(program_.greeting);
        read_step();
        read(output_);
        read(errors_);
    }

    void answer(std::string line)
    {
        line += '\n';
        error_code error;
        // It reads one answer at a time, so that the socket has room, or it breaks the rules.
        if (steps_.send(asio::buffer(line), 0, error) != line.size() && error != asio::error::broken_pipe)
            kill_group(id_);
        be_patient();
    }

    void end(std::string const& why)
    {
        listener_.program_printed("ERROR: " + quoted_name(program_) + ": " + why + ".", Output::error);
        kill_group(id_);
    }

    /// Nothing that it printed or sent counts any more.
    void forget()
    {
        error_code ignored;
        is_forgotten_ = true;
        waiting_.cancel();
        steps_.close(ignored);
        for (Stream* stream : {&output_, &errors_}) {
            stream->pipe.close(ignored);
            stream->pause.cancel();
        }
    }

    /// It has ended by itself: what it has printed last is told before that.
    void finish(int status)
    {
        tell_last_words(output_);
        tell_last_words(errors_);
        forget();
        bool const is_fault = status != 0;
        listener_.program_printed((is_fault ? "WARNING: " : "INFO: ") + quoted_name(program_) + " " +
                                      ending(status) + ". Its robot stands.",
                                  is_fault ? Output::error : Output::standard);
        listener_.program_ended(program_.robot);
    }

private:
    struct Stream
    {
        Stream(asio::io_context& context, int file, Output output_)
            : pipe(context, file), pause(context), output(output_)
        {}

        asio::posix::stream_descriptor pipe;
        asio::steady_timer pause;
        Output output;
        PrintedLines lines;
        std::array<char, 4096> bytes{};
        Clock::time_point second{}; ///< when the present one ends
        int allowed = 0;            ///< lines in it
    };

    void be_patient()
    {
        waiting_.expires_after(patience);
        waiting_.async_wait([self = shared_from_this()](error_code error) {
            if (error || self->is_asking_ || self->is_forgotten_)
                return;
            self->listener_.program_printed("WARNING: the simulation waits for " +
                                                quoted_name(self->program_) +
                                                ", which has not called robot.step() for " +
                                                std::to_string(patience.count()) + " seconds.",
                                            Output::error);
        });
        is_asking_ = false;
    }

    void read_step()
    {
        asio::async_read_until(steps_, asio::dynamic_buffer(request_, max_step_request), '\n',
                               [self = shared_from_this()](error_code error, std::size_t size) {
                                   if (self->is_forgotten_)
                                       return;
                                   if (error == asio::error::not_found)
                                       self->end("it sent what is no message");
                                   else if (!error)
                                       self->take_step(size);
                               });
    }

    void take_step(std::size_t size)
    {
        auto const request = parse_step_request(std::string_view(request_).substr(0, size - 1));
        request_.erase(0, size);
        if (!request)
            return end("it sent what is no message");
        is_asking_ = true;
        waiting_.cancel();
        read_step();
        listener_.step_requested(program_.robot, *request);
    }

    void read(Stream& stream)
    {
        // Read only then: what is read here must not be on its way while the last words are told.
        stream.pipe.async_wait(asio::posix::descriptor_base::wait_read,
                               [self = shared_from_this(), &stream](error_code error) {
                                   std::size_t size = 0;
                                   if (!error && !self->is_forgotten_)
                                       size = stream.pipe.read_some(asio::buffer(stream.bytes), error);
                                   if (size == 0 && error != asio::error::would_block)
                                       return;
                                   stream.lines.add({stream.bytes.data(), size});
                                   self->tell(stream);
                               });
    }

    /// Tells the lines that are allowed in this second, and reads on once all are told.
    void tell(Stream& stream)
    {
        if (auto const now = Clock::now(); now >= stream.second) {
            stream.second = now + std::chrono::seconds(1);
            stream.allowed = lines_per_second;
        }
        for (; stream.allowed > 0; --stream.allowed) {
            auto const line = stream.lines.next();
            if (!line)
                return read(stream);
            listener_.program_printed(*line, stream.output);
        }
        if (!was_slowed_down_)
            listener_.program_printed("WARNING: " + quoted_name(program_) + " prints more than " +
                                          std::to_string(lines_per_second) +
                                          " lines in a second: it is slowed down to that.",
                                      Output::error);
        was_slowed_down_ = true;
        stream.pause.expires_at(stream.second);
        stream.pause.async_wait([self = shared_from_this(), &stream](error_code error) {
            if (!error && !self->is_forgotten_)
                self->tell(stream);
        });
    }

    void tell_last_words(Stream& stream)
    {
        error_code error;
        for (std::size_t read = 0; !error && read < last_words;) {
            auto const size = stream.pipe.read_some(asio::buffer(stream.bytes), error);
            stream.lines.add({stream.bytes.data(), size});
            read += size;
        }
        int told = 0;
        for (auto line = stream.lines.last(); line; line = stream.lines.last()) {
            if (++told > lines_per_second)
                continue;
            listener_.program_printed(*line, stream.output);
        }
        if (told > lines_per_second)
            listener_.program_printed("INFO: " + std::to_string(told - lines_per_second) +
                                          " more lines are left out.",
                                      Output::error);
    }

    Program const program_;
    pid_t const id_;
    ProgramListener& listener_;
    asio::local::stream_protocol::socket steps_;
    std::string request_;
    bool is_asking_ = false; ///< for a step, so that it waits for us
    asio::steady_timer waiting_;
    Stream output_;
    Stream errors_;
    bool was_slowed_down_ = false;
    bool is_forgotten_ = false; ///< handlers that are on their way do nothing
};

RobotPrograms::RobotPrograms(asio::io_context& context)
    : context_(context), children_(context, SIGCHLD), start_timer_(context)
{
    wait_for_children();
}

RobotPrograms::~RobotPrograms()
{
    end_all();
}

void RobotPrograms::start(std::vector<Program> programs, ProgramListener& listener)
{
    end_all();
    programs_ = std::move(programs);
    listener_ = &listener;
    start_timer_.cancel();
    if (Clock::now() >= next_start_)
        return start_all();
    start_timer_.expires_at(next_start_);
    start_timer_.async_wait([this](error_code error) {
        if (!error)
            start_all();
    });
}

void RobotPrograms::start_all()
{
    if (programs_.empty())
        return;
    next_start_ = Clock::now() + start_pause;
    for (Program& program : std::exchange(programs_, {})) {
        auto const robot = program.robot;
        auto const name = quoted_name(program);
        try {
            start_one(std::move(program));
        } catch (std::system_error const& failure) {
            listener_->program_printed("ERROR: " + name + " can't be started: " + failure.what(),
                                       Output::error);
            listener_->program_ended(robot);
        }
    }
}

void RobotPrograms::start_one(Program program)
{
    auto const python = program.kind == ProgramKind::python ? find_python() : std::nullopt;
    if (auto const missing = what_is_missing(program, python.has_value()); !missing.empty()) {
        listener_->program_printed(missing, Output::error);
        return listener_->program_ended(program.robot);
    }
    auto process = python ? start_python(*python, program.file) : start_executable(program.file);
    listener_->program_printed(
        "INFO: " + quoted_name(program) + ": starting " + program.file.filename().string(), Output::standard);
    auto const robot = program.robot;
    auto running = std::make_shared<Running>(context_, std::move(program), std::move(process), *listener_);
    running_[robot] = running;
    running->begin();
}

void RobotPrograms::end_all()
{
    for (auto const& [robot, running] : std::exchange(running_, {})) {
        running->forget();
        kill_group(running->id());
        ending_.insert(running->id());
    }
}

void RobotPrograms::answer(std::size_t robot, std::string line)
{
    if (auto const found = running_.find(robot); found != running_.end())
        found->second->answer(std::move(line));
}

void RobotPrograms::end(std::size_t robot, std::string const& why)
{
    if (auto const found = running_.find(robot); found != running_.end())
        found->second->end(why);
}

void RobotPrograms::wait_for_children()
{
    children_.async_wait([this](error_code error, int) {
        if (error)
            return;
        reap();
        wait_for_children();
    });
}

void RobotPrograms::reap()
{
    std::erase_if(ending_, [](pid_t id) { return ::waitpid(id, nullptr, WNOHANG) != 0; });
    std::vector<std::pair<std::shared_ptr<Running>, int>> finished;
    for (auto entry = running_.begin(); entry != running_.end();) {
        auto const& running = entry->second;
        if (!has_ended(running->id())) {
            ++entry;
            continue;
        }
        kill_group(running->id()); // what it has left behind
        int status = 0;
        ::waitpid(running->id(), &status, 0);
        finished.emplace_back(running, status);
        entry = running_.erase(entry);
    }
    for (auto const& [running, status] : finished)
        running->finish(status);
}

} // namespace webots_cloud::demo
