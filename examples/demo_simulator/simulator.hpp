// The simulator without its sockets: it is told what browsers say and that time has passed, and tells its
// Audience what they get.
#pragma once

#include "arena.hpp"
#include "client_message.hpp"
#include "command_line.hpp"
#include "picture.hpp"
#include "playback.hpp"
#include "programs.hpp"

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

using ClientId = std::uint64_t;
using Text = std::shared_ptr<std::string const>; ///< one frame, shared by all who receive it

/// Where the simulator's answers go.
class Audience
{
public:
    virtual ~Audience() = default;

    /// Sends one text frame. A state frame may be left out when the client reads too slowly.
    virtual void send(ClientId client, Text text, bool is_state) = 0;

    /// The picture is out of date.
    virtual void picture_changed() = 0;

    /// The same, and somebody waits for it who can't use the last one: it has another size.
    virtual void picture_resized() = 0;

    /// The simulation started to run or paused.
    virtual void mode_changed() = 0;
};

/// The simulation and its conversation with the clients: knows the protocol, and neither sockets nor clocks.
class Simulator : private ProgramListener
{
public:
    /// `print` writes one line to stdout. All references must outlive the simulator.
    Simulator(Options const& options, Audience& audience, Programs& programs,
              std::function<void(std::string_view)> print);

    /// Loads the world that the options name. Throws std::runtime_error with a sentence.
    void load();

    void connect(ClientId client);
    void disconnect(ClientId client);
    void receive(ClientId client, std::string_view text);

    bool is_running() const { return arena_ && playback_.mode() != Mode::pause; }
    bool is_loaded() const { return arena_.has_value(); }
    bool streams_pictures() const { return options_.stream == StreamMode::mjpeg; }
    /// Whether a client has said how large pictures are to be: Webots can't draw any before.
    bool has_picture_size() const { return has_picture_size_; }
    Mode mode() const { return playback_.mode(); }
    /// Steps between two state frames, so that there are at most WorldInfo.FPS of them a second.
    int steps_per_tick() const;

    /// Milliseconds that this number of steps simulates.
    int tick_time() const;

    /// Does up to `count` steps, fewer when the deadline comes first, and tells the clients. While a program
    /// computes, the rest waits for it until the next call.
    void advance(int count);

    /// Draws the present state; announces its time to every client. Only after load().
    std::string draw_picture();

    /// Draws one for nobody. The first takes ten times as long as others: it finds fonts, and what does not
    /// move.
    void draw_ahead();

    /// A line of a robot: goes to the browsers' consoles.
    void say(std::string const& line, Output output = Output::standard);

    /// Names of the robots whose controllers somebody else starts. Only after load().
    std::vector<std::string> extern_robots() const;

    /// How fast a robot drives on a free way, in radians per second. Only after load().
    void set_cruise(std::string const& robot, double cruise);

    /// Those of the world; none before load().
    std::vector<RobotDescription> const& robots() const;

    /// The folder that holds the folder of the world.
    std::filesystem::path project_root() const;

private:
    struct Client
    {
        bool joined = false; ///< has sent its mode line
    };

    void on(ClientId client, message::JoinScene const& join);
    void on(ClientId client, message::JoinPictures const& join);
    void on(ClientId client, message::Pause);
    void on(ClientId client, message::Run const& run);
    void on(ClientId client, message::Step);
    void on(ClientId client, message::Timeout const& timeout);
    void on(ClientId client, message::Reset);
    void on(ClientId client, message::Reload);
    void on(ClientId client, message::Load const& load);
    void on(ClientId client, message::Resize const& resize);
    void on(ClientId client, message::Mouse const& mouse);
    void on(ClientId client, message::Ignored) { (void)client; }
    void on(ClientId client, message::ToRobot const& message);
    void on(ClientId client, message::GetController const& question);
    void on(ClientId client, message::SetController const& change);
    void on(ClientId client, message::Unsupported) { (void)client; }

    // ProgramListener
    void step_requested(std::size_t robot, StepRequest const& request) override;
    void program_ended(std::size_t robot) override;
    void program_printed(std::string const& line, Output output) override { say(line, output); }

    void start_programs();
    void step();
    void do_due_steps();
    void do_single_step();
    void welcome(ClientId client);
    void send_world(ClientId client);
    void send(ClientId client, std::string text);
    void broadcast(std::string text, bool is_state = false);
    void log(std::string const& line);
    void publish_state();
    void set_mode(Mode mode);
    void pause_at_deadline();
    void change_world(std::filesystem::path const& file);
    std::string world_list() const;
    bool is_first(ClientId client) const;
    std::int64_t now() const { return arena_ ? arena_->time() : 0; }

    Options const& options_;
    Audience& audience_;
    Programs& programs_;
    std::function<void(std::string_view)> print_;
    std::filesystem::path world_file_;
    Playback playback_;
    std::optional<Arena> arena_;
    LockStep lock_step_;
    int due_steps_ = 0;                ///< of the last advance(), which wait for a program
    bool wants_single_step_ = false;   ///< waits for a program
    std::int64_t published_time_ = -1; ///< of the last state that the clients were told
    Picture picture_;
    bool has_picture_size_ = false;
    std::map<ClientId, Client> clients_; ///< ids grow, so the first entry connected first
    std::deque<std::string> console_;    ///< lines that nobody has heard
    std::optional<Point> mouse_at_;      ///< while a button is down
};

} // namespace webots_cloud::demo
