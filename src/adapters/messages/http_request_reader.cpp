// Each request passes here, so nothing is allocated from the second one of a connection on. Refusals are
// decided as early as possible: the end of garbage is not waited for.
#include "http_request_reader.hpp"

#include "core/text.hpp"
#include "head_parser.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

namespace {

constexpr std::size_t read_size = 4096; // bytes, at once
// With less, a sender of single bytes would have everything moved for each.
constexpr std::size_t min_room = 1024;
constexpr std::size_t max_method = 32;
constexpr std::uint64_t max_body = std::uint64_t{1} << 40; // no sum overflows

/// `HTTP/2.0` and the like at the end of a request line.
bool names_other_version(std::string_view line) noexcept
{
    auto const version = line.substr(line.rfind(' ') + 1);
    auto const is_digit = [](char c) { return c >= '0' && c <= '9'; };
    return version.size() == 8 && version.starts_with("HTTP/") && is_digit(version[5]) && version[6] == '.' &&
           is_digit(version[7]) && version != "HTTP/1.1" && version != "HTTP/1.0";
}

} // namespace

/// What Beast finds, for one request.
class HttpRequestReader::Parser final : public HeadParser<true>
{
public:
    explicit Parser(HttpRequestReader& reader) : reader_(reader)
    {
        header_limit(max_head); // the limits are the reader's
        skip(true);             // the caller reads the body, if anybody takes it
    }

    /// The status to refuse `text` with, 0 when nothing is wrong so far. `text` is a head, or how one begins.
    ///
    /// Flattened, since Beast advances from byte to byte through a reference to a pointer: inlined, that
    /// pointer is in a register, which makes `GET /session` a seventh shorter.
    [[gnu::flatten]] int read(std::string_view text)
    {
        text_ = text;
        boost::system::error_code error;
        put(asio::buffer(text), error);
        if (!error)
            return 0;
        is_incomplete_ = error == http::error::need_more;
        if (is_incomplete_)
            return 0;
        if (status_ == 0 && error == http::error::bad_version)
            status_ = names_other_version(text.substr(0, text.find("\r\n"))) ? 505 : 400;
        return status_ == 0 ? 400 : status_;
    }

    bool is_incomplete() const noexcept { return is_incomplete_; }

    bool has_host() const noexcept { return hosts_ == 1 || (reader_.is_http_1_0_ && hosts_ == 0); }

private:
    static constexpr std::uint32_t max_head = max_request_line + max_header_size + 4;

    void on_request_impl(http::verb, beast::string_view method, beast::string_view target, int version,
                         boost::system::error_code& error) override
    {
        reader_.is_http_1_0_ = version == 10;
        reader_.request_.method = method;
        refuse(method.size() > max_method ? 400 : read_target(target), error);
    }

    void on_field_impl(http::field field, beast::string_view name, beast::string_view value,
                       boost::system::error_code& error) override
    {
        refuse(is_folded(name, value)                        ? 400
               : reader_.fields_.size() == max_header_fields ? 431
                                                             : note_field(field, name, value),
               error);
        reader_.fields_.emplace_back(name, value);
    }

    void refuse(int status, boost::system::error_code& error)
    {
        status_ = status;
        if (status != 0)
            error = http::error::bad_field;
    }

    /// Beast joins the lines of a folded field in a place of its own, or begins after the first when that is
    /// empty. Proxies may read such fields differently (RFC 9112, 5.2).
    bool is_folded(std::string_view name, std::string_view value) const
    {
        auto const* const colon = name.data() + name.size();
        std::less<char const*> const before;
        return before(value.data(), colon) || before(text_.data() + text_.size(), value.data()) ||
               std::find(colon, value.data(), '\r') != value.data();
    }

    int note_field(http::field field, std::string_view name, std::string_view value)
    {
        switch (field) {
        case http::field::host:
            ++hosts_;
            return 0;
        case http::field::upgrade:
            reader_.has_upgrade_ = true;
            return 0;
        case http::field::forwarded:
            reader_.is_forwarded_ = true;
            return 0;
        case http::field::unknown:
            reader_.is_forwarded_ = reader_.is_forwarded_ || equal_ignoring_case(name, "X-Forwarded-For");
            return 0;
        case http::field::content_length:
            note_length(value);
            return 0;
        case http::field::transfer_encoding:
            reader_.has_strange_body_ = true;
            return 0;
        default:
            return 0;
        }
    }

    /// Beast takes a list of equal lengths, too, of which proxies may take the first or the last.
    void note_length(std::string_view value)
    {
        if (value.find_first_not_of('0') == std::string_view::npos)
            return;
        std::uint64_t length = 0;
        auto const [end, error] = std::from_chars(value.data(), value.data() + value.size(), length);
        bool const is_number = error == std::errc() && end == value.data() + value.size();
        reader_.has_strange_body_ =
            reader_.has_strange_body_ || !is_number || length > max_body || reader_.body_length_ != 0;
        reader_.body_length_ = length;
    }

    int read_target(std::string_view target)
    {
        // Asterisk form (RFC 9112, 3.2.4), as health checks of proxies send it.
        if (target == "*" && reader_.request_.method == "OPTIONS") {
            reader_.request_.path = target;
            reader_.request_.query = {};
            return 0;
        }
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
        auto& request = reader_.request_;
        request.path = question == 0 ? std::string_view("/") : target.substr(0, question);
        request.query = question == target.size() ? std::string_view() : target.substr(question + 1);
        return 0;
    }

    HttpRequestReader& reader_;
    std::string_view text_;
    int status_ = 0;
    int hosts_ = 0;
    bool is_incomplete_ = false;
};

std::span<char> HttpRequestReader::prepare()
{
    if (begin_ == end_)
        begin_ = end_ = 0;
    if (capacity_ - end_ < min_room) {
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
    auto const start = received().substr(0, max_method + 1);
    if (int const status = Parser(*this).read(start); status != 0)
        return refuse(status);
    if (start.size() > max_method && start.find(' ') == std::string_view::npos)
        return refuse(400);
    return received().size() > max_request_line ? refuse(414) : Progress::need_more;
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
        if (newline - 1 > max_request_line)
            return refuse(414);
        line_ = newline + 1;
        // A head without fields ends with the end of this line.
        seen_ = newline - 1;
        // The fields are still to come: no need to wait for them when the request line is malformed.
        if (line_ == text.size())
            if (int const status = Parser(*this).read(text); status != 0)
                return refuse(status);
    }
    auto const end = text.find("\r\n\r\n", seen_);
    bool const is_complete = end != std::string_view::npos;
    auto const fields = (is_complete ? end + 2 : text.size()) - line_;
    if (fields > max_header_size)
        return refuse(431);
    // Of its end, three of four bytes may have come.
    seen_ = text.size() - std::min<std::size_t>(3, text.size());
    if (!is_complete)
        return Progress::need_more;
    head_ = end + 4;
    int const status = read_head(text.substr(0, head_));
    if (status != 0)
        return refuse(status);
    return body_length_ == 0 ? Progress::complete : Progress::with_body;
}

/// The status to refuse a complete head with, or 0.
int HttpRequestReader::read_head(std::string_view head)
{
    fields_.clear();
    has_upgrade_ = is_forwarded_ = has_strange_body_ = false;
    body_length_ = 0;
    Parser parser(*this);
    if (int const status = parser.read(head); status != 0)
        return status;
    if (parser.is_incomplete() || !parser.has_host())
        return 400;
    if (has_strange_body_)
        return 413;
    keep_alive_ = parser.keep_alive();
    connection_upgrades_ = parser.upgrade();
    request_.headers = fields_;
    return 0;
}

} // namespace webots_cloud::adapters
