// Gives a parser of Beast's what a connection has brought. Unlike Beast's own `async_read`, whose code is as
// long as all the rest of a client, and is written anew for each kind of message and stream.
#pragma once

#include <boost/asio/error.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/basic_parser.hpp>
#include <boost/beast/http/error.hpp>

#include <cstddef>

namespace webots_cloud::adapters {

/// Takes what has come from the buffer. What follows the message stays there.
template<bool is_request>
boost::beast::error_code parse_received(boost::beast::http::basic_parser<is_request>& parser,
                                        boost::beast::flat_buffer& buffer)
{
    boost::beast::error_code failed;
    std::size_t used = 1;
    while (!failed && used > 0 && buffer.size() > 0 && !parser.is_done()) {
        used = parser.put(buffer.data(), failed);
        buffer.consume(used);
    }
    if (failed == boost::beast::http::error::need_more)
        failed = {};
    return failed;
}

/// Nothing more comes, and `why`: that may be how the message ends.
template<bool is_request>
boost::beast::error_code parse_end(boost::beast::http::basic_parser<is_request>& parser,
                                   boost::beast::error_code why)
{
    if (why != boost::asio::error::eof)
        return why;
    if (!parser.got_some())
        return boost::beast::http::error::end_of_stream;
    boost::beast::error_code failed;
    parser.put_eof(failed);
    return failed;
}

} // namespace webots_cloud::adapters
