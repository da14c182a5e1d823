// By what a client is counted: itself, and the wider networks that may be all its own.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <string_view>

namespace webots_cloud::core {

/// One of them.
struct QuotaLevel
{
    QuotaLevel() = default;

    std::string_view key;   ///< The client's quota key, or the name of a wider network.
    std::size_t factor = 1; ///< How many times as much as one client all of it together may have.
};

/// A subscriber with IPv6 has a /64 network at least, a home often a /56, and a /48 is what any site may ask
/// for (RFC 6177, RIPE-690): 256 or 65,536 clients, if only /64 networks were counted. But the /64 networks
/// of a /56 or /48 may also be as many strangers, as the phones of a mobile network are. So all of a /56 may
/// have twice as much as one client, and all of a /48 four times as much: with four times as many guesses,
/// one site can't use up those of everybody (`passwords_of_all`).
///
/// IPv4 addresses, keys that are no addresses, and private networks of IPv6 have one level. There are no
/// levels for nobody, the empty key.
///
/// Lifetime: `key` must outlive it.
class QuotaLevels
{
    static constexpr std::size_t wider = 2;

public:
    static constexpr std::size_t most = 1 + wider;

    explicit QuotaLevels(std::string_view key) : size_(key.empty() ? 0 : 1)
    {
        levels_[0].key = key;
        if (may_have_more(key))
            add_wider(key.substr(0, key.size() - subscriber.size()));
    }
    QuotaLevels(QuotaLevels const&) = delete;
    QuotaLevels& operator=(QuotaLevels const&) = delete;

    /// False: the only level is the key itself.
    static constexpr bool may_have_more(std::string_view key) noexcept { return key.ends_with(subscriber); }

    /// From the client itself to the widest network.
    QuotaLevel const* begin() const noexcept { return levels_.data(); }
    QuotaLevel const* end() const noexcept { return levels_.data() + size_; }
    std::size_t size() const noexcept { return size_; }

private:
    static constexpr std::string_view subscriber = "/64"; // as `IpAddress::quota_key` writes it
    static constexpr std::size_t max_name = sizeof("ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff/56");

    void add_wider(std::string_view network);

    std::array<QuotaLevel, most> levels_;
    std::array<std::array<char, max_name>, wider> names_; // of the levels behind the first; else not set
    std::size_t size_;
};

/// How much a level with this factor may have, where one client may have `of_client` of `all`: never more
/// than three quarters of all, unless one client may.
constexpr std::size_t allowance(std::size_t of_client, std::size_t factor,
                                std::size_t all = std::numeric_limits<std::size_t>::max()) noexcept
{
    bool const is_beyond = of_client > std::numeric_limits<std::size_t>::max() / factor;
    auto const wanted = is_beyond ? all : of_client * factor;
    return std::max(of_client, std::min(wanted, all - all / 4));
}

/// For tables of quota keys, in which a `std::string_view` can be looked up.
struct QuotaKeyHash
{
    using is_transparent = void;
    std::size_t operator()(std::string_view key) const noexcept { return std::hash<std::string_view>()(key); }
};

} // namespace webots_cloud::core
