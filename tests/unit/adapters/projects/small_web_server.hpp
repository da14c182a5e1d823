// A server for sources of projects to ask, on a thread of its own and a free port of the loopback interface.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace webots_cloud {

/// Answers each request by a function, which the thread calls.
class SmallWebServer
{
public:
    using Request = boost::beast::http::request<boost::beast::http::string_body>;
    using Response = boost::beast::http::response<boost::beast::http::string_body>;
    using Answer = std::function<void(Request const&, Response&)>;

    explicit SmallWebServer(Answer answer)
        : acceptor_(context_, {boost::asio::ip::address_v4::loopback(), 0}), answer_(std::move(answer)),
          thread_([this] { serve(); })
    {}

    ~SmallWebServer()
    {
        over_ = true;
        boost::system::error_code ignored;
        boost::asio::ip::tcp::socket(context_).connect(acceptor_.local_endpoint(),
                                                       ignored); // wakes the thread
        thread_.join();
    }

    std::string url() const
    {
        return "http://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port());
    }

    /// How many requests were answered.
    int asked() const { return asked_; }

private:
    void serve()
    {
        while (!over_) {
            boost::system::error_code failed;
            boost::asio::ip::tcp::socket socket(context_);
            acceptor_.accept(socket, failed);
            boost::beast::flat_buffer buffer;
            Request request;
            if (!failed)
                boost::beast::http::read(socket, buffer, request, failed);
            if (failed)
                continue;
            ++asked_;
            Response response;
            response.keep_alive(false); // one thread serves one connection after the other
            answer_(request, response);
            response.prepare_payload();
            boost::beast::http::write(socket, response, failed);
        }
    }

    boost::asio::io_context context_;
    boost::asio::ip::tcp::acceptor acceptor_;
    Answer answer_;
    std::atomic<bool> over_ = false;
    std::atomic<int> asked_ = 0;
    std::thread thread_;
};

} // namespace webots_cloud
