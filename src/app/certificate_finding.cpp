#include "certificate_finding.hpp"

#include "adapters/tls/certificate_facts.hpp"
#include "core/doctor/named_hosts.hpp"
#include "core/doctor/network_findings.hpp"

#include <webots_cloud/adapters/http_server.hpp>

#include <chrono>
#include <string>

namespace webots_cloud::app {

CertificateFinding find_certificate_faults(NetworkConfig const& network, PublicAddress const& address)
{
    auto const host = address.host == "*" ? std::string() : std::string(core::host_in(address.host));
    auto const pair = check_certificate(network.ssl_certificate, network.ssl_key);
    auto const facts = adapters::read_certificate(network.ssl_certificate, host);
    CertificateFinding found;
    found.finding = core::judge_certificate(pair, facts, host, std::chrono::system_clock::now());
    found.is_usable = pair.has_value();
    if (!pair && pair.error().message().starts_with("the key "))
        found.key = "sslKey";
    return found;
}

} // namespace webots_cloud::app
