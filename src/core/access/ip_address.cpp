#include "ip_address.hpp"

#include "core/text.hpp"

#include <boost/url/ipv4_address.hpp>
#include <boost/url/ipv6_address.hpp>

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr std::array<std::uint8_t, 12> v4_mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
constexpr int v4_offset = 96;
constexpr int all_bits = 128;
constexpr int subscriber_bits = 64;

IpAddress::Bytes map(boost::urls::ipv4_address const& address)
{
    auto const v4 = address.to_bytes();
    IpAddress::Bytes bytes{};
    std::copy(v4.begin(), v4.end(), std::copy(v4_mapped.begin(), v4_mapped.end(), bytes.begin()));
    return bytes;
}

/// -1 for anything that is no number from 0 to `max`.
int read_bits(std::string_view text, int max)
{
    int bits = -1;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), bits);
    bool const is_number = error == std::errc() && end == text.data() + text.size();
    return is_number && bits <= max ? bits : -1;
}

} // namespace

std::optional<IpAddress> IpAddress::parse(std::string_view text)
{
    if (text.find(':') == std::string_view::npos) {
        auto const v4 = boost::urls::parse_ipv4_address(text);
        return v4 ? std::optional(IpAddress(map(*v4))) : std::nullopt;
    }
    auto const v6 = boost::urls::parse_ipv6_address(text.substr(0, text.find('%')));
    return v6 ? std::optional(IpAddress(v6->to_bytes())) : std::nullopt;
}

bool IpAddress::is_v4() const noexcept
{
    return std::equal(v4_mapped.begin(), v4_mapped.end(), bytes_.begin());
}

IpAddress IpAddress::network(int bits) const noexcept
{
    auto network = *this;
    for (int byte = 0; byte < static_cast<int>(network.bytes_.size()); ++byte) {
        int const kept = std::clamp(bits - 8 * byte, 0, 8);
        network.bytes_[static_cast<std::size_t>(byte)] &= static_cast<std::uint8_t>(0xff00 >> kept);
    }
    return network;
}

std::string IpAddress::text() const
{
    if (!is_v4())
        return boost::urls::ipv6_address(bytes_).to_string();
    boost::urls::ipv4_address::bytes_type v4{};
    std::copy(bytes_.begin() + v4_mapped.size(), bytes_.end(), v4.begin());
    return boost::urls::ipv4_address(v4).to_string();
}

std::string IpAddress::quota_key() const
{
    return is_v4() ? text() : concat(network(subscriber_bits).text(), "/64");
}

std::optional<IpNetwork> IpNetwork::parse(std::string_view text)
{
    auto const slash = text.find('/');
    auto const first = IpAddress::parse(text.substr(0, slash));
    if (!first || text.find('%') != std::string_view::npos)
        return std::nullopt;
    IpNetwork network;
    network.first_ = *first;
    if (slash == std::string_view::npos)
        return network;
    // 10.0.0.0/8 counts from where IPv4 begins, ::ffff:10.0.0.0/104 from the start.
    bool const is_dotted = text.find(':') == std::string_view::npos;
    int const offset = is_dotted ? v4_offset : 0;
    int const bits = read_bits(text.substr(slash + 1), all_bits - offset);
    network.bits_ = offset + bits;
    bool const is_network = bits >= 0 && first->network(network.bits_) == *first &&
                            (!first->is_v4() || network.bits_ >= v4_offset);
    return is_network ? std::optional(network) : std::nullopt;
}

bool IpNetwork::contains(IpAddress const& address) const noexcept
{
    auto const& ours = first_.bytes();
    auto const& theirs = address.bytes();
    auto const whole = static_cast<std::size_t>(bits_ / 8); // bytes; no copy: this is asked for each request
    bool const begins_alike = std::equal(ours.begin(), ours.begin() + whole, theirs.begin());
    bool const differs = bits_ % 8 != 0 && ((ours[whole] ^ theirs[whole]) >> (8 - bits_ % 8)) != 0;
    return begins_alike && !differs && address.is_v4() == first_.is_v4();
}

IpNetworks::IpNetworks(std::vector<std::string> const& networks)
{
    for (auto const& text : networks) {
        if (auto const network = IpNetwork::parse(text))
            networks_.push_back(*network);
        else if (malformed_.empty())
            malformed_ = text.empty() ? "an empty text" : text;
    }
}

bool IpNetworks::contains(IpAddress const& address) const noexcept
{
    return std::any_of(networks_.begin(), networks_.end(),
                       [&](IpNetwork const& network) { return network.contains(address); });
}

} // namespace webots_cloud::core
