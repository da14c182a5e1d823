// What the gateway of the session server passes on, and where: `/2000/...` to the simulation server of that
// port.
#pragma once

#include <webots_cloud/server_spec.hpp>
#include <webots_cloud/transport/http.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// A numeric address and a port.
struct NumericAddress
{
    NumericAddress() = default;

    std::string host; ///< Without brackets.
    std::uint16_t port = 0;
};

/// `10.0.0.2:2000` or `[2001:db8::2]:2000`.
std::optional<NumericAddress> parse_numeric_address(std::string_view text);

/// Where a machine is reached from inside.
struct InternalAddress
{
    InternalAddress() = default;

    std::string host; ///< Without brackets. A numeric address; with TLS a name, too.
    std::uint16_t port = 0;
    bool tls = false;
    std::string name; ///< With TLS: what its certificate is for; empty: the host.

    bool operator==(InternalAddress const&) const = default;
};

/// A numeric address and a port, which are reached by plain HTTP; or `https://sim2.example.org:2000`,
/// `wss://...`: a name or an address, by TLS.
std::optional<InternalAddress> parse_internal_address(std::string_view text);

/// The URL of a path there.
std::string internal_url(std::string_view internal_address, std::string_view path);

/// Where a request to a machine goes.
struct InternalRequest
{
    InternalRequest() = default;

    std::string url;
    std::string address; ///< Numeric: where to connect, unless empty, instead of looking up the URL's host.
};

/// The same where the machine's certificate may be for another name, `internal_name`: the URL has that.
/// Precondition: with such a name, `parse_internal_address` reads the address.
InternalRequest internal_request(std::string_view internal_address, std::string_view internal_name,
                                 std::string_view path);

/// `10.0.0.2:2000`, `sim2.example.org:2000`: the `Host` of requests there.
std::string authority_of(InternalAddress const& machine);

/// `2001` or `2001-2100`: the first and the last port.
std::optional<std::pair<std::uint16_t, std::uint16_t>> parse_port_range(std::string_view text);

/// A path that begins with a port.
struct PortPath
{
    PortPath() = default;

    std::uint16_t port = 0;
    std::string_view rest; ///< What follows the port; starts with `/`.
};

/// `/2000/client`: 2000 and `/client`; `/2000`: 2000 and `/`.
std::optional<PortPath> split_port_path(std::string_view path) noexcept;

/// `/metrics` and all below `/api`, however it is spelled: the operator's, never passed on.
bool is_operators_path(std::string_view path);

/// The port at the end of `host/2000` and of `host/webots/2000`; 0: there is none.
std::uint16_t public_port(std::string_view address) noexcept;

/// Where a request goes.
struct ForwardTarget
{
    ForwardTarget() = default;

    InternalAddress machine;
    std::string target; ///< Path and query.
    /// What answers there: one of the machine's simulators, its server, or the monitor of one that is
    /// trusted.
    UpstreamKind kind = UpstreamKind::simulation;
    bool is_trusted = false;   ///< `ServerSpec::trusted`.
    bool is_elsewhere = false; ///< `ServerSpec::elsewhere`.
};

/// To the simulation server of a machine. `path` starts with `/`.
ForwardTarget target_at_machine(InternalAddress machine, bool is_trusted, std::string_view path,
                                std::string_view query);

/// The ports of all simulation servers behind the gateway. Nothing else is ever passed on: no part of a
/// request becomes a host or a port.
class ForwardingTable
{
public:
    ForwardingTable() = default; ///< Passes nothing on.

    /// Servers without an internal address are left out, and those with a path of their own. Of equal ports
    /// the first counts.
    explicit ForwardingTable(std::vector<ServerSpec> const& servers);

    /// One more, behind those that are there.
    void add(ServerSpec const& server);

    bool empty() const noexcept { return ranges_.empty(); }

    /// Whether a port is a machine's, on any path.
    bool knows(std::uint16_t port) const noexcept { return range_of(port) != nullptr; }

    /// Empty: this is not passed on.
    std::optional<ForwardTarget> find(std::string_view path, std::string_view query) const;

private:
    /// Ports that lie side by side in public paths and on a machine.
    struct Range
    {
        Range() = default;

        std::uint16_t first = 0; ///< In public paths.
        std::uint16_t last = 0;
        InternalAddress machine; ///< With what the first port is there.
        bool is_of_simulators = false;
        bool is_trusted = false;
        bool is_elsewhere = false;
    };

    Range const* range_of(std::uint16_t port) const noexcept;

    std::vector<Range> ranges_;
};

} // namespace webots_cloud::core
