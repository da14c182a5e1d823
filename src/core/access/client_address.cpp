#include "client_address.hpp"

#include "core/text.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

// Proxies in a row. Only trusted ones can write a longer chain: what their clients claim is never read.
constexpr int max_hops = 32;

/// The text between quotes, without them; other text as it is.
std::string_view unquote(std::string_view text) noexcept
{
    bool const is_quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
    return is_quoted ? text.substr(1, text.size() - 2) : text;
}

/// `192.0.2.1`, `192.0.2.1:80`, `2001:db8::1`, `[2001:db8::1]` and `[2001:db8::1]:80`.
std::optional<IpAddress> parse_node(std::string_view text)
{
    if (text.starts_with('[')) {
        auto const end = text.find(']');
        bool const is_closed = end != std::string_view::npos;
        auto const rest = is_closed ? text.substr(end + 1) : std::string_view();
        return is_closed && (rest.empty() || rest.starts_with(':'))
                   ? IpAddress::parse(text.substr(1, end - 1))
                   : std::nullopt;
    }
    auto const colon = text.find(':');
    bool const has_port =
        colon != std::string_view::npos && text.find(':', colon + 1) == std::string_view::npos;
    return IpAddress::parse(has_port ? text.substr(0, colon) : text);
}

std::optional<IpAddress> parse_plain(std::string_view entry)
{
    return parse_node(unquote(entry));
}

/// An entry of Forwarded: `for=192.0.2.1;proto=https`. A comma or semicolon within quotes, which addresses
/// never have, makes it unreadable.
std::optional<IpAddress> parse_element(std::string_view entry)
{
    while (!entry.empty()) {
        auto const end = std::min(entry.size(), entry.find(';'));
        auto const pair = trim(entry.substr(0, end));
        entry.remove_prefix(std::min(entry.size(), end + 1));
        auto const equals = std::min(pair.size(), pair.find('='));
        if (equal_ignoring_case(trim(pair.substr(0, equals)), "for"))
            return parse_node(unquote(trim(pair.substr(std::min(pair.size(), equals + 1)))));
    }
    return std::nullopt;
}

/// Walks through the entries of a field from the right to the client.
class Walk
{
public:
    using Parse = std::optional<IpAddress> (*)(std::string_view entry);

    Walk(IpNetworks const& proxies, Parse parse) : proxies_(proxies), parse_(parse) {}

    void take(std::string_view value)
    {
        while (!done_ && !value.empty()) {
            auto const comma = value.rfind(',');
            bool const is_first = comma == std::string_view::npos;
            // RFC 9110, 5.6.1: empty entries of lists are ignored.
            if (auto const entry = trim(is_first ? value : value.substr(comma + 1)); !entry.empty())
                take_entry(entry);
            value = value.substr(0, is_first ? 0 : comma);
        }
    }

    bool has_begun() const noexcept { return hops_ > 0; }
    std::optional<IpAddress> const& client() const noexcept { return client_; }

private:
    void take_entry(std::string_view entry)
    {
        auto const address = parse_(entry);
        if (address)
            client_ = address;
        ++hops_;
        done_ = !address || !proxies_.contains(*address) || hops_ == max_hops;
    }

    IpNetworks const& proxies_;
    Parse parse_;
    std::optional<IpAddress> client_;
    int hops_ = 0;
    bool done_ = false;
};

Walk walk(HeaderFields fields, std::string_view name, IpNetworks const& proxies, Walk::Parse parse)
{
    Walk walk(proxies, parse);
    for (auto field = fields.rbegin(); field != fields.rend(); ++field)
        if (equal_ignoring_case(field->first, name))
            walk.take(field->second);
    return walk;
}

} // namespace

std::optional<IpAddress> forwarded_client(HeaderFields fields, IpNetworks const& proxies)
{
    auto const usual = walk(fields, "X-Forwarded-For", proxies, parse_plain);
    return usual.has_begun() ? usual.client() : walk(fields, "Forwarded", proxies, parse_element).client();
}

} // namespace webots_cloud::core
