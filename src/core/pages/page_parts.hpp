// What the pages at /monitor of both servers share: their frame, and figures as people read them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What makes a page live. Everything stands in the page itself: behind a proxy that knows `/monitor` alone
/// nothing else of us can be reached.
struct PageAssets
{
    PageAssets() = default;

    std::string_view logo;  ///< SVG.
    std::string_view texts; ///< What scripts say, by language: JSON.
    std::vector<std::string_view> styles;
    std::vector<std::string_view> scripts; ///< Run in this order, at the end of the page.
    /// For each script, SHA-256 of a newline and the script, in hexadecimal: no other script runs in the
    /// page.
    std::vector<std::string_view> script_hashes;
    std::uint16_t port =
        0; ///< Our own: behind a proxy that rewrites ports the live channel is at `/<port>/monitor`.
    /// With it the live channel is open to the page where it has no origin; empty: it is not.
    std::string key;
};

/// Up to the heading.
std::string page_begin(std::string_view title, std::string_view heading, PageAssets const& assets);

/// `data`: elements that scripts read.
std::string page_end(PageAssets const& assets, std::string_view data);

/// To at most two decimals, as the servers have always shown loads: `7.88`, `0.0`.
std::string rounded(double value);

} // namespace webots_cloud::core
