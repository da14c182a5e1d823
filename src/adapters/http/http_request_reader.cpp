#include "http_request_reader.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t read_size = 4096;
constexpr std::size_t least_room =
    1024; // with less, a sender of single bytes would have everything moved for each
constexpr std::size_t longest_method = 32;

/// The characters of methods and field names (RFC 9110, 5.6.2).
constexpr auto token_characters = [] {
    std::array<bool, 256> is_token{};
    for (char const c :
         std::string_view("!#$%&'*+-.^_`|~0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"))
        is_token[static_cast<unsigned char>(c)] = true;
    return is_token;
}();

bool is_token(std::string_view text) noexcept
{
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
        return token_characters[static_cast<unsigned char>(c)];
    });
}

bool is_control(char c) noexcept
{
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

bool is_digit(char c) noexcept
{
    return c >= '0' && c <= '9';
}

} // namespace

std::span<char> HttpRequestReader::prepare()
{
    if (begin_ == end_)
        begin_ = end_ = 0;
    if (capacity_ - end_ < least_room) {
        // The buffer stays small: nothing is read before all complete requests in it were answered.
        auto const size = end_ - begin_;
        auto const wanted = std::max(capacity_, size + read_size);
        auto larger = std::make_unique_for_overwrite<char[]>(wanted);
        if (size > 0)
            std::memcpy(larger.get(), buffer_.get() + begin_, size);
        buffer_ = std::move(larger);
        capacity_ = wanted;
        begin_ = 0;
        end_ = size;
    }
    return {buffer_.get() + end_, capacity_ - end_};
}

void HttpRequestReader::next() noexcept
{
    begin_ += head_;
    head_ = line_ = seen_ = 0;
}

HttpRequestReader::Progress HttpRequestReader::refuse(int status) noexcept
{
    refusal_ = status;
    return Progress::refused;
}

/// What can be said of a request line whose end has not come: garbage need not be waited for.
HttpRequestReader::Progress HttpRequestReader::refuse_incomplete_line() noexcept
{
    auto const start = received().substr(0, longest_method + 1);
    auto const method = start.substr(0, start.find(' '));
    if (method.size() > longest_method || !is_token(method))
        return refuse(400);
    return received().size() > longest_request_line ? refuse(414) : Progress::need_more;
}

HttpRequestReader::Progress HttpRequestReader::parse()
{
    // RFC 9112, 2.2: empty lines before a request are to be ignored.
    while (seen_ == 0 && begin_ < end_ && (buffer_[begin_] == '\r' || buffer_[begin_] == '\n'))
        ++begin_;
    auto const text = received();
    if (text.empty())
        return Progress::need_more;
    if (line_ == 0) {
        auto const newline = text.find('\n', seen_);
        seen_ = text.size();
        if (newline == std::string_view::npos)
            return refuse_incomplete_line();
        if (text[newline - 1] != '\r')
            return refuse(400);
        if (newline - 1 > longest_request_line)
            return refuse(414);
        line_ = newline + 1;
        seen_ = newline - 1;
        if (line_ ==
            text.size()) // the fields are still to come: nobody need wait for them when the line is wrong
            if (int const status = read_request_line(text.substr(0, newline - 1)); status != 0)
                return refuse(status);
    }
    auto const end = text.find("\r\n\r\n", seen_);
    bool const is_complete = end != std::string_view::npos;
    auto const fields = (is_complete ? end + 2 : text.size()) - line_;
    if (fields > longest_header)
        return refuse(431);
    seen_ = text.size() - std::min<std::size_t>(3, text.size());
    if (!is_complete)
        return Progress::need_more;
    head_ = end + 4;
    int const status = read_head(text.substr(0, end + 2));
    return status == 0 ? Progress::complete : refuse(status);
}

/// Each of these returns the status to refuse with, or 0.
int HttpRequestReader::read_head(std::string_view head)
{
    fields_.clear();
    hosts_ = 0;
    is_http_1_0_ = has_upgrade_ = connection_upgrades_ = is_forwarded_ = false;
    keep_alive_ = true;
    if (int const status = read_request_line(head.substr(0, line_ - 2)); status != 0)
        return status;
    for (head.remove_prefix(line_); !head.empty();) {
        auto const end = head.find("\r\n");
        if (int const status = read_field(head.substr(0, end)); status != 0)
            return status;
        head.remove_prefix(end + 2);
    }
    bool const has_host = hosts_ == 1 || (is_http_1_0_ && hosts_ == 0);
    request_.headers = fields_;
    return has_host ? 0 : 400;
}

int HttpRequestReader::read_request_line(std::string_view line)
{
    auto const first = line.find(' ');
    auto const last = line.rfind(' ');
    if (first == std::string_view::npos || first == last || first > longest_method ||
        !is_token(line.substr(0, first)))
        return 400;
    auto const version = line.substr(last + 1);
    if (version.size() != 8 || !version.starts_with("HTTP/") || !is_digit(version[5]) || version[6] != '.' ||
        !is_digit(version[7]))
        return 400;
    if (version[5] != '1')
        return 505;
    is_http_1_0_ = version[7] == '0';
    keep_alive_ = !is_http_1_0_;
    request_.method = line.substr(0, first);
    return read_target(line.substr(first + 1, last - first - 1));
}

int HttpRequestReader::read_target(std::string_view target)
{
    if (std::any_of(target.begin(), target.end(), [](char c) { return is_control(c) || c == ' '; }))
        return 400;
    // Absolute form, as clients of a proxy send it: the authority is nothing to us.
    if (!target.starts_with('/')) {
        auto const scheme = target.substr(0, target.find("://"));
        if (!equal_ignoring_case(scheme, "http") && !equal_ignoring_case(scheme, "https"))
            return 400;
        target.remove_prefix(std::min(target.size(), scheme.size() + 3));
        auto const authority = std::min(target.size(), target.find_first_of("/?"));
        if (authority == 0)
            return 400;
        target.remove_prefix(authority);
    }
    auto const question = std::min(target.size(), target.find('?'));
    request_.path = question == 0 ? std::string_view("/") : target.substr(0, question);
    request_.query = question == target.size() ? std::string_view() : target.substr(question + 1);
    return 0;
}

int HttpRequestReader::read_field(std::string_view line)
{
    auto const colon = line.find(':');
    // A blank before the colon or at the start of a line is how requests are smuggled past proxies.
    if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
        return 400;
    auto const value = core::trim(line.substr(colon + 1));
    if (std::any_of(value.begin(), value.end(), [](char c) { return is_control(c) && c != '\t'; }))
        return 400;
    if (fields_.size() == most_header_fields)
        return 431;
    fields_.emplace_back(line.substr(0, colon), value);
    return note_field(line.substr(0, colon), value);
}

int HttpRequestReader::note_field(std::string_view name, std::string_view value)
{
    switch (name.size()) { // most fields are none of these, and this tells so at once
    case 4:
        hosts_ += equal_ignoring_case(name, "Host") ? 1 : 0;
        return 0;
    case 7:
        has_upgrade_ = has_upgrade_ || equal_ignoring_case(name, "Upgrade");
        return 0;
    case 9:
        is_forwarded_ = is_forwarded_ || equal_ignoring_case(name, "Forwarded");
        return 0;
    case 10:
        if (equal_ignoring_case(name, "Connection"))
            note_connection(value);
        return 0;
    case 14:
        if (!equal_ignoring_case(name, "Content-Length"))
            return 0;
        if (value.empty() || !std::all_of(value.begin(), value.end(), is_digit))
            return 400;
        // Nothing that we serve takes a body.
        return value.find_first_not_of('0') == std::string_view::npos ? 0 : 413;
    case 15:
        is_forwarded_ = is_forwarded_ || equal_ignoring_case(name, "X-Forwarded-For");
        return 0;
    case 17:
        return equal_ignoring_case(name, "Transfer-Encoding") ? 413 : 0;
    default:
        return 0;
    }
}

void HttpRequestReader::note_connection(std::string_view options)
{
    while (!options.empty()) {
        auto const comma = std::min(options.size(), options.find(','));
        auto const option = core::trim(options.substr(0, comma));
        options.remove_prefix(std::min(options.size(), comma + 1));
        if (equal_ignoring_case(option, "close"))
            keep_alive_ = false;
        else if (is_http_1_0_ && equal_ignoring_case(option, "keep-alive"))
            keep_alive_ = true;
        else if (equal_ignoring_case(option, "upgrade"))
            connection_upgrades_ = true;
    }
}

} // namespace webots_cloud::adapters
