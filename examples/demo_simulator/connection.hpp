#pragma once

#include "file_server.hpp"
#include "simulator.hpp"

#include <boost/asio/ip/tcp.hpp>

#include <memory>
#include <string>
#include <string_view>

namespace webots_cloud::demo {

struct ControllerAnswer;

/// A browser's WebSocket, as the server sees it.
class ClientOutlet
{
public:
    virtual ~ClientOutlet() = default;

    /// Queues one text frame. Leaves state frames out when the queue is long; closes the connection when it
    /// is longer than a sane client lets it grow.
    virtual void send(Text text, bool is_state) = 0;
};

/// A browser's `GET /mjpeg`, as the server sees it.
class PictureOutlet
{
public:
    virtual ~PictureOutlet() = default;

    /// False while the last picture is still on its way: pictures are left out, never queued.
    virtual bool is_ready() const = 0;
    virtual void send(Text part) = 0;
};

/// What connections ask of the server. It outlives them all.
class Reception
{
public:
    virtual ~Reception() = default;

    virtual ClientId open_client(std::weak_ptr<ClientOutlet> outlet) = 0;
    virtual void receive(ClientId client, std::string_view text) = 0;
    virtual void close_client(ClientId client) = 0;

    virtual bool streams_pictures() const = 0;
    virtual void open_pictures(std::weak_ptr<PictureOutlet> outlet) = 0;
    virtual void pictures_ready() = 0;

    virtual std::string answer_file(FileRequest const& request) const = 0;
    virtual ControllerAnswer answer_controller(std::string_view greeting) = 0;
    virtual void hear_controller(std::string const& robot, std::string const& line) = 0;
    virtual void close_controller(std::string const& robot) = 0;
};

/// Held by a connection as long as it lives: the server counts them.
using Seat = std::shared_ptr<void>;

/// Finds out from the first bytes which of the three protocols the peer speaks, and serves it until it goes.
void serve(boost::asio::ip::tcp::socket socket, Reception& reception, Seat seat);

/// Serves a peer that asked for pictures.
void serve_pictures(boost::asio::ip::tcp::socket socket, Reception& reception, Seat seat);

} // namespace webots_cloud::demo
