// Numeric addresses of IPv4 and IPv6, and networks of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// An address. IPv4 is kept as the IPv6 address that it is mapped to, so that both spellings are equal.
class IpAddress
{
public:
    using Bytes = std::array<std::uint8_t, 16>;

    IpAddress() = default; ///< `::`
    explicit IpAddress(Bytes const& v6) : bytes_(v6) {}

    /// Without port and brackets; the zone of a link-local address is dropped.
    static std::optional<IpAddress> parse(std::string_view text);

    Bytes const& bytes() const noexcept { return bytes_; }
    bool is_v4() const noexcept;

    /// With all but the first `bits` of its 128 bits cleared; those of IPv4 are the last 32.
    IpAddress network(int bits) const noexcept;

    std::string text() const;

    /// What a client is counted by: its address, or with IPv6 its /64 network, since a subscriber has at
    /// least that many addresses. Nothing that `text` of an address returns equals the name of a network.
    std::string quota_key() const;

    bool operator==(IpAddress const&) const = default;

private:
    Bytes bytes_{};
};

/// An address, or a network as in `10.0.0.0/8`.
class IpNetwork
{
public:
    IpNetwork() = default; ///< `::/128`

    /// Nothing when it is neither, or when bits below the network are set: `10.0.0.1/8` may be meant as
    /// either.
    static std::optional<IpNetwork> parse(std::string_view text);

    /// Networks of IPv6 contain no IPv4.
    bool contains(IpAddress const& address) const noexcept;

    /// All of IPv4 or IPv6.
    bool is_everybody() const noexcept { return bits_ == (first_.is_v4() ? 96 : 0); }

private:
    IpAddress first_;
    int bits_ = 128;
};

/// Several of them, as a configuration lists them.
class IpNetworks
{
public:
    /// `networks`: as `IpNetwork::parse` reads them; what it can't read is left out, see `malformed`.
    explicit IpNetworks(std::vector<std::string> const& networks = {});

    bool contains(IpAddress const& address) const noexcept;
    bool empty() const noexcept { return networks_.empty(); }

    /// The first entry that is no address and no network, or empty.
    std::string const& malformed() const noexcept { return malformed_; }

private:
    std::vector<IpNetwork> networks_;
    std::string malformed_;
};

} // namespace webots_cloud::core
