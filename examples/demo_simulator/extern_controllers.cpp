#include "extern_controllers.hpp"

#include "world_file.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <charconv>
#include <memory>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t max_said = 64 * 1024; ///< Without the end of a line.

/// What is said and not taken is not read either: one line is on its way at a time.
class ExternController : public std::enable_shared_from_this<ExternController>
{
public:
    ExternController(tcp::socket socket, std::string robot, Reception& reception, Seat seat)
        : socket_(std::move(socket)), robot_(std::move(robot)), reception_(reception), seat_(std::move(seat))
    {}

    void say(std::string text)
    {
        said_ = std::move(text);
        asio::async_write(socket_, asio::buffer(said_),
                          [self = shared_from_this()](error_code error, std::size_t) {
                              error ? self->reception_.close_controller(self->robot_) : self->hear();
                          });
    }

private:
    void hear()
    {
        asio::async_read_until(socket_, asio::dynamic_buffer(heard_, max_said), '\n',
                               [self = shared_from_this()](error_code error, std::size_t size) {
                                   if (error)
                                       return self->reception_.close_controller(self->robot_);
                                   auto line = self->heard_.substr(0, size);
                                   self->heard_.erase(0, size);
                                   self->reception_.hear_controller(self->robot_, line.substr(0, size - 1));
                                   self->say(std::move(line));
                               });
    }

    tcp::socket socket_;
    std::string robot_;
    std::string heard_;
    std::string said_;
    Reception& reception_;
    Seat seat_;
};

/// What follows the name of a field; nothing: it is not there.
std::optional<std::string_view> robot_in(std::string_view greeting)
{
    constexpr std::string_view field = "Robot-Name:";
    constexpr std::string_view blanks = " \r\n\t";
    auto begin = greeting.find(field);
    if (begin == std::string_view::npos)
        return std::nullopt;
    begin = std::min(greeting.find_first_not_of(blanks, begin + field.size()), greeting.size());
    return greeting.substr(begin, greeting.find_first_of(blanks, begin) - begin);
}

} // namespace

ControllerAnswer ExternControllers::connect(std::string_view greeting, std::vector<std::string> const& robots)
{
    auto const called = robot_in(greeting);
    auto const robot = std::ranges::find_if(robots, [&](std::string const& each) {
        return called ? encoded_name(each) == *called : robots.size() == 1;
    });
    if (robot == robots.end())
        return {"FAILED", {}};
    if (!connected_.insert(*robot).second)
        return {"FORBIDDEN", {}};
    return {"CONNECTED", *robot};
}

std::string encoded_name(std::string_view name)
{
    constexpr std::string_view digits = "0123456789ABCDEF";
    std::string text;
    for (char const c : name) {
        auto const byte = static_cast<unsigned char>(c);
        bool const is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                              std::string_view("-._~").find(c) != std::string_view::npos;
        if (is_plain)
            text += c;
        else
            text.append({'%', digits[byte >> 4], digits[byte & 15]});
    }
    return text;
}

std::optional<double> cruise_in(std::string_view line)
{
    constexpr std::string_view word = "cruise ";
    double value = 0;
    if (!line.starts_with(word))
        return std::nullopt;
    auto const* const end = line.data() + line.size();
    auto const read = std::from_chars(line.data() + word.size(), end, value);
    bool const is_number = read.ec == std::errc() && read.ptr == end && value >= 0 && value <= max_cruise;
    return is_number ? std::optional(value) : std::nullopt;
}

void serve_controller(tcp::socket socket, ControllerAnswer answer, Reception& reception, Seat seat)
{
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    std::make_shared<ExternController>(std::move(socket), std::move(answer.robot), reception, std::move(seat))
        ->say(std::move(answer.text));
}

} // namespace webots_cloud::demo
