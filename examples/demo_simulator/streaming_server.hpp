#pragma once

#include "command_line.hpp"
#include "connection.hpp"
#include "extern_consoles.hpp"
#include "extern_controllers.hpp"
#include "robot_programs.hpp"
#include "simulator.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::demo {

/// The sockets and timers around a Simulator. Runs on one thread, that of the io_context, and must live
/// until the io_context has stopped. While the simulation is paused no timer runs.
class StreamingServer : private Audience, private Reception
{
public:
    static constexpr int max_connections = 64;

    StreamingServer(boost::asio::io_context& context, Options const& options);

    /// Binds the port (or, when it is busy, one of the next ten) and accepts from now on.
    /// Throws std::runtime_error with a sentence.
    void listen();

    /// Loads the world. Throws std::runtime_error with a sentence.
    void load();

    /// Makes the first picture as quick as others. Takes some tens of milliseconds.
    void draw_ahead() { simulator_.draw_ahead(); }

    boost::asio::ip::tcp::endpoint endpoint() const { return acceptor_.local_endpoint(); }
    bool is_running() const { return simulator_.is_running(); }

private:
    struct Stream
    {
        std::weak_ptr<PictureOutlet> outlet;
        std::uint64_t seen = 0; ///< the revision that it was sent last
    };

    // Audience
    void send(ClientId client, Text text, bool is_state) override;
    void picture_changed() override;
    void picture_resized() override;
    void mode_changed() override;

    // Reception
    ClientId open_client(std::weak_ptr<ClientOutlet> outlet) override;
    void receive(ClientId client, std::string_view text) override { simulator_.receive(client, text); }
    void close_client(ClientId client) override;
    bool streams_pictures() const override { return simulator_.streams_pictures(); }
    void open_pictures(std::weak_ptr<PictureOutlet> outlet) override;
    void pictures_ready() override { schedule_picture(); }
    std::string answer_file(FileRequest const& request) const override;
    ControllerAnswer answer_controller(std::string_view greeting) override;
    void hear_controller(std::string const& robot, std::string const& line) override;
    void close_controller(std::string const& robot) override;

    bool bind(boost::asio::ip::tcp::endpoint const& endpoint, boost::system::error_code& error);
    void accept();
    void schedule_tick();
    void tick(std::uint64_t run);
    void schedule_picture();
    void send_picture();
    bool wants_picture() const;

    boost::asio::io_context& context_;
    Options const& options_;
    RobotPrograms programs_;
    Simulator simulator_;
    ExternConsoles extern_consoles_;
    ExternControllers extern_controllers_;
    boost::asio::ip::tcp::acceptor acceptor_;
    boost::asio::steady_timer accept_pause_;
    std::shared_ptr<int> connections_ = std::make_shared<int>(0);
    std::map<ClientId, std::weak_ptr<ClientOutlet>> clients_;
    ClientId next_client_ = 1;

    boost::asio::steady_timer tick_timer_;
    std::chrono::steady_clock::time_point next_tick_;
    std::uint64_t run_ = 0; ///< counts changes of the mode: a tick of an earlier run does nothing

    boost::asio::steady_timer picture_timer_;
    bool picture_scheduled_ = false;
    std::chrono::steady_clock::time_point next_picture_{};
    std::uint64_t revision_ = 1; ///< of the picture
    std::vector<Stream> streams_;
};

} // namespace webots_cloud::demo
