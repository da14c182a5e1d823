// What is wrong with the certificate of a server. The start, `--check-config` and the doctor say the same of
// it.
#pragma once

#include "core/doctor/finding.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/public_address.hpp>

#include <string_view>

namespace webots_cloud::app {

struct CertificateFinding
{
    CertificateFinding() = default;

    core::Finding finding;
    std::string_view key = "sslCertificate"; ///< Of the configuration: the one that it is about.
    bool is_usable = true;                   ///< The server can start with it.
};

/// Reads the files of a server that has a certificate.   Thread-safety: any thread.
CertificateFinding find_certificate_faults(NetworkConfig const& network, PublicAddress const& address);

} // namespace webots_cloud::app
