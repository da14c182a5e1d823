// What a certificate says of itself, and whether browsers will believe it.
#pragma once

#include <webots_cloud/time.hpp>

#include <string>

namespace webots_cloud::core {

/// One certificate, as its holder shows it.
struct CertificateFacts
{
    CertificateFacts() = default;

    std::string names;  ///< Whom it is for, as in "robots.example.org, 10.0.0.1".
    std::string issuer; ///< The authority that has signed it.
    WallTime begins;    ///< It is valid from here
    WallTime ends;      ///< to here.
    bool fits = true;   ///< It is for the host that was asked about.
    int key_bits = 0;
    bool is_weak = false; ///< Its key is so short that browsers refuse it: RSA of 1024 bits, for instance.
    /// Why nobody believes it, whatever the day is, as in "unable to get local issuer certificate"; empty: an
    /// authority that this machine trusts vouches for it.
    std::string chain_problem;
};

} // namespace webots_cloud::core
