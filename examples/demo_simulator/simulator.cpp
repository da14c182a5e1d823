// What the simulator does for its browsers, message by message and step by step: modes, pictures and
// scenes, resets, other worlds. Without sockets: it tells its Audience.
#include "simulator.hpp"

#include "controller_files.hpp"
#include "controllers.hpp"
#include "scene.hpp"
#include "text.hpp"

#include <boost/json.hpp>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

namespace webots_cloud::demo {
namespace {

constexpr std::size_t console_memory = 20; ///< lines that wait for somebody who hears them
constexpr std::size_t max_listed_worlds = 100;

} // namespace

Simulator::Simulator(Options const& options, Audience& audience, Programs& programs,
                     std::function<void(std::string_view)> print)
    : options_(options), audience_(audience), programs_(programs), print_(std::move(print)),
      world_file_(std::filesystem::absolute(options.world).lexically_normal()), playback_(options.mode)
{}

void Simulator::load()
{
    broadcast("loading:Parsing nodes:0");
    World world = world_from_file(world_file_);
    find_programs(world, world_file_);
    read_cruise(world, world_file_);
    for (std::string const& warning : world.warnings)
        say("demo simulator: " + warning);
    if (!arena_) // controllers go on when the world is loaded again
        start_controllers(world, world_file_);
    arena_.emplace(std::move(world));
    start_programs();
    broadcast("loading:Finalizing nodes:100");
    for (auto const& [id, client] : clients_)
        if (client.joined)
            welcome(id);
    audience_.picture_changed();
    audience_.mode_changed();
}

void Simulator::connect(ClientId client)
{
    clients_.emplace(client, Client{});
}

void Simulator::disconnect(ClientId client)
{
    clients_.erase(client);
}

void Simulator::receive(ClientId client, std::string_view text)
{
    if (!clients_.contains(client))
        return;
    message::Message const message = message::parse(text);
    if (std::holds_alternative<message::Unsupported>(message))
        return log("Unsupported message: " + printable(text, 80));
    bool const joins = std::holds_alternative<message::JoinScene>(message) ||
                       std::holds_alternative<message::JoinPictures>(message);
    if (!arena_ && !joins)
        return log("Ignored message while the world is loading: " + printable(text, 80));
    std::visit([this, client](auto const& m) { on(client, m); }, message);
}

void Simulator::on(ClientId client, message::JoinScene const& join)
{
    if (streams_pictures())
        return log("Ignored a client that asks for the scene: pictures are streamed");
    // A client that does not broadcast must ask for time, or the simulation pauses at its next step.
    playback_.set_deadline(now(), join.broadcast ? -1 : 0);
    clients_[client].joined = true;
    if (arena_)
        welcome(client);
}

void Simulator::on(ClientId client, message::JoinPictures const& join)
{
    if (!streams_pictures())
        return log("Ignored a client that asks for pictures: the scene is streamed");
    bool const decides_size = !has_picture_size_ || is_first(client);
    if (decides_size)
        picture_.resize(join.size.width, join.size.height);
    has_picture_size_ = true;
    clients_[client].joined = true;
    if (arena_)
        welcome(client);
    decides_size ? audience_.picture_resized() : audience_.picture_changed();
}

void Simulator::on(ClientId client, message::Pause)
{
    set_mode(Mode::pause);
    print_("pause");
    send(client, "paused by client");
}

void Simulator::on(ClientId client, message::Run const& run)
{
    wants_single_step_ = false;
    playback_.set_deadline(now(), run.duration);
    set_mode(run.fast ? Mode::fast : Mode::real_time);
    print_(playback_.state_name());
    send(client, playback_.state_name());
}

void Simulator::on(ClientId client, message::Step)
{
    print_("step");
    set_mode(Mode::pause);
    wants_single_step_ = true;
    do_single_step();
    print_("pause");
    send(client, "paused by client");
}

void Simulator::on(ClientId, message::Timeout const& timeout)
{
    playback_.set_deadline(now(), timeout.duration);
}

void Simulator::on(ClientId, message::Reset)
{
    // Controllers start again, so that what has been changed in them counts.
    World world = arena_->world();
    world.warnings.clear();
    find_programs(world, world_file_);
    read_cruise(world, world_file_);
    for (std::string const& warning : world.warnings)
        say("demo simulator: " + warning);
    arena_.emplace(std::move(world));
    playback_.clear_deadline();
    print_("reset");
    publish_state();
    broadcast("reset finished");
    start_programs();
}

void Simulator::on(ClientId, message::Reload)
{
    change_world(world_file_);
}

void Simulator::on(ClientId, message::Load const& load)
{
    std::filesystem::path const file = world_file_.parent_path() / load.name;
    std::error_code error;
    bool const usable = load.name.ends_with(".wbt") && load.name.find('\0') == std::string::npos &&
                        std::filesystem::is_regular_file(file, error);
    if (!usable)
        return log("Unknown world: " + printable(load.name, 80));
    change_world(file);
}

void Simulator::on(ClientId client, message::Resize const& resize)
{
    if (!streams_pictures() || !is_first(client))
        return;
    picture_.resize(resize.size.width, resize.size.height);
    broadcast("resize: " + std::to_string(picture_.width()) + " " + std::to_string(picture_.height()));
    audience_.picture_changed();
}

/// Dragging turns the view, the wheel zooms it.
void Simulator::on(ClientId client, message::Mouse const& mouse)
{
    if (!streams_pictures() || !is_first(client))
        return;
    constexpr double radians_per_pixel = 0.008;
    if (mouse.type == 2)
        picture_.view().zoom_by(mouse.wheel > 0 ? 0.9 : 1 / 0.9);
    else if (mouse_at_ && mouse.type == 0)
        picture_.view().rotate(-radians_per_pixel * std::clamp(mouse.x - mouse_at_->x, -400.0, 400.0),
                               radians_per_pixel * std::clamp(mouse.y - mouse_at_->y, -400.0, 400.0));
    bool const holding = mouse.type == -1 || (mouse.type == 0 && mouse_at_ && mouse.buttons != 0);
    mouse_at_ = holding ? std::optional(Point{mouse.x, mouse.y}) : std::nullopt;
    audience_.picture_changed();
}

void Simulator::on(ClientId, message::ToRobot const& message)
{
    std::string const name = printable(message.name, 60);
    auto const& robots = arena_->robots();
    bool const known = std::any_of(robots.begin(), robots.end(),
                                   [&](Robot const& robot) { return robot.description.name == name; });
    if (!known)
        return log("Ignored message for unknown robot: " + name);
    boost::json::object answer;
    answer["message"] = "received " + printable(message.text, 200);
    answer["name"] = name;
    broadcast("robot: " + boost::json::serialize(answer));
}

void Simulator::on(ClientId client, message::GetController const& question)
{
    if (!options_.controller_edit)
        return log("Ignored an editor: --stream has no controllerEdit");
    for (auto const& file : controller_files(world_file_, question.name)) {
        if (!question.file.empty() && question.file != file.name)
            continue;
        auto const& text = file.content;
        auto const lines = std::count(text.begin(), text.end(), '\n') + (text.ends_with('\n') ? 0 : 1);
        send(client,
             "set controller:" + question.name + "/" + file.name + ":" + std::to_string(lines) + "\n" + text);
    }
}

void Simulator::on(ClientId, message::SetController const& change)
{
    if (!options_.controller_edit)
        return log("Ignored an editor: --stream has no controllerEdit");
    auto const problem = save_controller_file(world_file_, change.name, change.file, change.content);
    say("demo simulator: " + (problem.empty() ? printable(change.name + "/" + change.file) +
                                                    " is saved: it counts after the next reset"
                                              : problem));
}

int Simulator::steps_per_tick() const
{
    World const& world = arena_->world();
    int const shortest = 1000 / world.frames_per_second;
    return std::max(1, (shortest + world.time_step - 1) / world.time_step);
}

int Simulator::tick_time() const
{
    return steps_per_tick() * arena_->world().time_step;
}

void Simulator::advance(int count)
{
    due_steps_ = count;
    do_due_steps();
    if (now() != published_time_)
        publish_state();
    if (playback_.must_pause(now()))
        pause_at_deadline();
}

void Simulator::do_due_steps()
{
    for (; due_steps_ > 0 && is_running() && !playback_.must_pause(now()) && lock_step_.may_step();
         --due_steps_)
        step();
}

void Simulator::do_single_step()
{
    if (!wants_single_step_ || is_running() || !lock_step_.may_step())
        return;
    wants_single_step_ = false;
    step();
    publish_state();
}

void Simulator::step()
{
    for (std::string const& remark : arena_->step())
        say(remark);
    for (std::size_t const robot : lock_step_.due(now()))
        programs_.answer(robot, measurements(*arena_, robot));
}

void Simulator::start_programs()
{
    due_steps_ = 0;
    wants_single_step_ = false;
    auto const& robots = arena_->world().robots;
    lock_step_.reset(robots.size());
    std::vector<Program> programs;
    for (std::size_t i = 0; i < robots.size(); ++i) {
        if (robots[i].program.empty())
            continue;
        lock_step_.begin(i);
        programs.push_back({i, robots[i].controller, robots[i].program, robots[i].program_kind,
                            greeting(arena_->world(), robots[i])});
    }
    programs_.start(std::move(programs), *this);
}

void Simulator::step_requested(std::size_t robot, StepRequest const& request)
{
    if (!lock_step_.ask(robot, now(), request.duration))
        return programs_.end(robot, "it sent a message out of turn");
    arena_->drive(robot, request.drive);
    do_single_step();
    do_due_steps();
}

void Simulator::program_ended(std::size_t robot)
{
    lock_step_.end(robot);
    arena_->drive(robot, {});
    do_single_step();
    do_due_steps();
}

void Simulator::pause_at_deadline()
{
    set_mode(Mode::pause);
    playback_.clear_deadline();
    broadcast(playback_.state_text(now()));
    // Webots writes the line once for each client.
    for (auto const& [id, client] : clients_)
        if (client.joined)
            print_("pause");
    if (clients_.empty())
        print_("pause");
}

std::string Simulator::draw_picture()
{
    broadcast("time: " + std::to_string(now()), true);
    return picture_.draw(*arena_, playback_.mode());
}

void Simulator::draw_ahead()
{
    if (streams_pictures())
        picture_.draw(*arena_, playback_.mode());
}

std::vector<RobotDescription> const& Simulator::robots() const
{
    static std::vector<RobotDescription> const none;
    return arena_ ? arena_->world().robots : none;
}

std::filesystem::path Simulator::project_root() const
{
    return world_file_.parent_path().parent_path();
}

void Simulator::welcome(ClientId client)
{
    if (streams_pictures()) {
        std::string greeting = std::string("multimedia: mjpeg ") + playback_.state_name() + " ";
        if (!is_first(client))
            greeting += std::to_string(picture_.width()) + " " + std::to_string(picture_.height());
        send(client, std::move(greeting));
        send(client, playback_.state_text(now()));
        boost::json::object info;
        info["title"] = arena_->world().title;
        info["window"] = "<none>";
        send(client, "world info: " + boost::json::serialize(info));
    }
    send_world(client);
    // As of Webots: what nobody has heard waits for whoever joins first.
    for (std::string const& line : std::exchange(console_, {}))
        send(client, line);
}

void Simulator::send_world(ClientId client)
{
    send(client, world_list());
    if (streams_pictures()) {
        send(client, "scene load completed");
        return;
    }
    send(client, "model:" + scene_xml(*arena_));
    send(client, update_json(*arena_));
    send(client, "scene load completed");
    send(client, playback_.state_text(now()));
}

void Simulator::send(ClientId client, std::string text)
{
    audience_.send(client, std::make_shared<std::string const>(std::move(text)), false);
}

void Simulator::broadcast(std::string text, bool is_state)
{
    auto const shared = std::make_shared<std::string const>(std::move(text));
    for (auto const& [id, client] : clients_)
        if (client.joined)
            audience_.send(id, shared, is_state);
}

void Simulator::set_cruise(std::string const& robot, double cruise)
{
    arena_->set_cruise(robot, cruise);
}

std::vector<std::string> Simulator::extern_robots() const
{
    std::vector<std::string> names;
    for (auto const& robot : arena_->world().robots)
        if (robot.controller == "<extern>")
            names.push_back(robot.name);
    return names;
}

void Simulator::say(std::string const& line, Output output)
{
    if (options_.echo_console)
        print_(line);
    std::string text = (output == Output::standard ? "stdout:" : "stderr:") + line;
    bool const is_heard =
        std::any_of(clients_.begin(), clients_.end(), [](auto const& entry) { return entry.second.joined; });
    if (is_heard)
        return broadcast(std::move(text));
    console_.push_back(std::move(text));
    if (console_.size() > console_memory)
        console_.pop_front();
}

/// A line of the simulator itself: goes to the process's stdout.
void Simulator::log(std::string const& line)
{
    print_("demo simulator: " + line);
}

void Simulator::publish_state()
{
    published_time_ = now();
    if (streams_pictures())
        audience_.picture_changed();
    else if (!clients_.empty())
        broadcast(update_json(*arena_), true);
}

void Simulator::set_mode(Mode mode)
{
    if (mode == playback_.mode())
        return;
    playback_.set_mode(mode);
    audience_.mode_changed();
    audience_.picture_changed();
}

void Simulator::change_world(std::filesystem::path const& file)
{
    try {
        World world = world_from_file(file);
        find_programs(world, file);
        read_cruise(world, file);
        Arena fresh(std::move(world));
        broadcast("delete world");
        broadcast("loading:Parsing nodes:0");
        world_file_ = file;
        arena_.emplace(std::move(fresh));
        broadcast("loading:Finalizing nodes:100");
    } catch (std::runtime_error const& error) {
        return log(printable(error.what()));
    }
    playback_.clear_deadline();
    for (std::string const& warning : arena_->world().warnings)
        say("demo simulator: " + warning);
    for (auto const& [id, client] : clients_)
        if (client.joined)
            streams_pictures() ? send_world(id) : welcome(id);
    start_programs();
    audience_.mode_changed();
    audience_.picture_changed();
}

/// `world:<current>:<world>;<world>;...`, paths from the project's folder.
std::string Simulator::world_list() const
{
    std::string const folder = printable(world_file_.parent_path().filename().string(), 100) + "/";
    std::set<std::string> names{world_file_.filename().string()};
    std::error_code error;
    for (std::filesystem::directory_iterator entry(world_file_.parent_path(), error), end;
         !error && entry != end && names.size() < max_listed_worlds; entry.increment(error))
        if (entry->path().extension() == ".wbt")
            names.insert(entry->path().filename().string());
    std::string text = "world:" + folder + printable(world_file_.filename().string()) + ":";
    bool first = true;
    for (std::string const& name : names) {
        text += (first ? "" : ";") + folder + printable(name);
        first = false;
    }
    return text;
}

bool Simulator::is_first(ClientId client) const
{
    return !clients_.empty() && clients_.begin()->first == client;
}

} // namespace webots_cloud::demo
