#include "page_parts.hpp"

#include "core/base64.hpp"
#include "core/text.hpp"

#include <cmath>

namespace webots_cloud::core {
namespace {

std::string bytes_of(std::string_view digits)
{
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
        bytes += static_cast<char>(16 * hex_digit(digits[i]) + hex_digit(digits[i + 1]));
    return bytes;
}

/// What the page may load and run: its own scripts, and the live channel.
std::string policy(PageAssets const& assets)
{
    std::string scripts;
    for (auto const hash : assets.script_hashes)
        scripts += concat(" 'sha256-", base64(bytes_of(hash)), "'");
    return concat("default-src 'none'; script-src", scripts.empty() ? " 'none'" : scripts,
                  "; style-src 'unsafe-inline'; img-src data:; connect-src 'self' ws: wss:; base-uri 'none'; "
                  "form-action 'none'");
}

} // namespace

std::string page_begin(std::string_view title, std::string_view heading, PageAssets const& assets)
{
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                       "<meta name=\"color-scheme\" content=\"light dark\">\n";
    html += concat("<meta http-equiv=\"Content-Security-Policy\" content=\"", policy(assets), "\">\n");
    // nothing else of us may be reachable
    html += concat("<link rel=\"icon\" href=\"data:image/svg+xml;base64,", base64(assets.logo), "\">\n");
    html += concat("<title>", escape_html(title), "</title>\n");
    for (auto const style : assets.styles)
        html.append("<style>\n").append(style).append("</style>\n");
    html.append(concat("</head>\n<body data-port=\"", std::to_string(assets.port),
                       assets.key.empty() ? "" : "\" data-key=\"", assets.key, "\">\n<header>\n", assets.logo,
                       "<h1>", escape_html(heading), "</h1>\n</header>\n<main>\n"));
    return html;
}

std::string page_end(PageAssets const& assets, std::string_view data)
{
    auto html = concat("</main>\n", data);
    for (auto const script : assets.scripts)
        html.append("<script>\n").append(script).append("</script>\n");
    return html + "</body>\n</html>\n";
}

std::string rounded(double value)
{
    return python_float(std::round(value * 100) / 100);
}

} // namespace webots_cloud::core
