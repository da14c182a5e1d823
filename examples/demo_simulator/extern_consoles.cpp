#include "extern_consoles.hpp"

#include "console.hpp"
#include "text.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>

#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string_view>

namespace webots_cloud::demo {
namespace {

namespace fs = std::filesystem;
namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;

constexpr std::size_t max_line = 4096;
constexpr std::size_t max_path = 107; // of the addresses of such sockets

std::string user()
{
    for (char const* const name : {"USER", "USERNAME"})
        if (char const* const value = std::getenv(name); value && *value)
            return value;
    return "default";
}

bool is_folder_name(std::string_view name)
{
    return !name.empty() && name.front() != '.' && name.find('/') == std::string_view::npos;
}

} // namespace

/// Of one robot. It has one controller at a time; the next one waits until that has left.
class ExternConsoles::Console
{
public:
    Console(asio::io_context& context, std::function<void(std::string const&)> const& say)
        : say_(say), acceptor_(context), controller_(context)
    {}

    void listen(fs::path const& path)
    {
        fs::create_directories(path.parent_path());
        fs::remove(path);
        acceptor_.open();
        acceptor_.bind(path.string());
        acceptor_.listen();
        accept();
    }

private:
    void accept()
    {
        acceptor_.async_accept(controller_, [this](error_code error) {
            if (!error)
                read();
        });
    }

    void read()
    {
        asio::async_read_until(controller_, asio::dynamic_buffer(text_, max_line), '\n',
                               [this](error_code error, std::size_t size) {
                                   if (error)
                                       return leave();
                                   say_(printable(std::string_view(text_).substr(0, size - 1), max_line));
                                   text_.erase(0, size);
                                   read();
                               });
    }

    void leave()
    {
        error_code ignored;
        controller_.close(ignored);
        text_.clear();
        accept();
    }

    std::function<void(std::string const&)> const& say_;
    stream_protocol::acceptor acceptor_;
    stream_protocol::socket controller_;
    std::string text_;
};

ExternConsoles::ExternConsoles(asio::io_context& context, std::function<void(std::string const&)> say)
    : context_(context), say_(std::move(say))
{}

ExternConsoles::~ExternConsoles() = default;

void ExternConsoles::open(std::vector<std::string> const& robots, unsigned short port)
{
    auto const ipc = fs::path("/tmp/webots") / user() / std::to_string(port) / "ipc";
    for (auto const& robot : robots) {
        auto const path = ipc / robot / "extern";
        if (!is_folder_name(robot) || path.native().size() > max_path)
            continue;
        auto& console = consoles_.emplace_back(std::make_unique<Console>(context_, say_));
        try {
            console->listen(path);
            print_line("INFO: '" + printable(robot) + "' extern controller: waiting for connection");
        } catch (std::exception const& failure) {
            print_line("ERROR: '" + printable(robot) + "' extern controller: " + failure.what());
        }
    }
}

} // namespace webots_cloud::demo
