// Reads what a certificate says of itself, for the doctor.
#pragma once

#include "core/doctor/certificate_facts.hpp"

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// The first certificate of a PEM file; those after it are its chain. `host`: a name or a numeric address;
/// empty: any will do. `authorities`: as for `make_http_client`. Blocks.
///
/// Errors: `invalid_config`, naming the file.
/// Thread-safety: any thread.
result<core::CertificateFacts> read_certificate(std::filesystem::path const& certificate,
                                                std::string const& host,
                                                std::filesystem::path const& authorities = {});

} // namespace webots_cloud::adapters
