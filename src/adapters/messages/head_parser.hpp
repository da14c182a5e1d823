// Beast's parser for the heads of messages.
#pragma once

#include <boost/beast/http/basic_parser.hpp>

namespace webots_cloud::adapters {

/// What it says of bodies, and of the other kind of message, is of no interest here: a class that derives
/// from it overrides what is left.
template<bool is_request>
class HeadParser : public boost::beast::http::basic_parser<is_request>
{
    using Text = boost::beast::string_view;
    using Error = boost::system::error_code;

    void on_request_impl(boost::beast::http::verb, Text, Text, int, Error&) override {}
    void on_response_impl(int, Text, int, Error&) override {}
    void on_header_impl(Error&) override {}
    void on_body_init_impl(boost::optional<std::uint64_t> const&, Error&) override {}
    std::size_t on_body_impl(Text, Error&) override { return 0; }
    void on_chunk_header_impl(std::uint64_t, Text, Error&) override {}
    std::size_t on_chunk_body_impl(std::uint64_t, Text, Error&) override { return 0; }
    void on_finish_impl(Error&) override {}
};

} // namespace webots_cloud::adapters
