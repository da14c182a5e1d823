// Takes the fields out of forms, urlencoded or in parts, as browsers and simulation servers send them.
#include "form.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>
#include <charconv>
#include <optional>

namespace website_host {

using webots_cloud::equal_ignoring_case;
using webots_cloud::Failure;
using webots_cloud::result;

namespace {

constexpr std::size_t max_fields = 32;
constexpr std::size_t max_name = 100;
constexpr std::size_t max_boundary = 70; // RFC 2046, 5.1.1

Failure malformed()
{
    return Failure(webots_cloud::errc::invalid_argument, "The form can't be understood.");
}

std::string_view trimmed(std::string_view text)
{
    auto const begin = std::min(text.size(), text.find_first_not_of(" \t"));
    auto const end = text.find_last_not_of(" \t") + 1;
    return text.substr(begin, std::max(begin, end) - begin);
}

/// The part before `separator`, which is taken away from `text` with it.
std::string_view take_until(std::string_view& text, std::string_view separator)
{
    auto const part = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(text.size(), part.size() + separator.size()));
    return part;
}

/// The value of `name=value` or `name="value"` among what follows the first `;` of a header.
std::optional<std::string> parameter(std::string_view header, std::string_view name)
{
    header.remove_prefix(std::min(header.size(), header.find(';')));
    while (header.starts_with(';')) {
        header.remove_prefix(1);
        auto const equals = header.find('=');
        if (equals == std::string_view::npos)
            return std::nullopt;
        auto const found = trimmed(header.substr(0, equals));
        header.remove_prefix(equals + 1);
        std::string value;
        if (header.starts_with('"')) {
            std::size_t at = 1;
            for (; at < header.size() && header[at] != '"'; ++at) {
                if (header[at] == '\\' && at + 1 < header.size())
                    ++at;
                value.push_back(header[at]);
            }
            if (at >= header.size())
                return std::nullopt; // no quote at the end
            header.remove_prefix(at + 1);
            header.remove_prefix(std::min(header.size(), header.find(';')));
        } else {
            value = trimmed(header.substr(0, header.find(';')));
            header.remove_prefix(std::min(header.size(), header.find(';')));
        }
        if (equal_ignoring_case(found, name))
            return value;
    }
    return std::nullopt;
}

result<> add(Form& form, std::string name, std::string value)
{
    if (name.empty() || name.size() > max_name || (form.size() == max_fields && !form.contains(name)))
        return malformed();
    form.insert_or_assign(std::move(name), std::move(value));
    return {};
}

result<Form> parse_urlencoded(std::string_view body)
{
    auto const decoded = [](std::string_view text) {
        std::string spaced(text);
        std::replace(spaced.begin(), spaced.end(), '+', ' ');
        return percent_decoded(spaced);
    };
    Form form;
    while (!body.empty()) {
        auto value = take_until(body, "&");
        if (value.empty())
            continue;
        auto const name = take_until(value, "=");
        if (auto const added = add(form, decoded(name), decoded(value)); !added)
            return added.error();
    }
    return form;
}

/// The name of the field whose part begins with these headers.
std::optional<std::string> field_name(std::string_view headers)
{
    while (!headers.empty()) {
        auto line = take_until(headers, "\r\n");
        auto const name = take_until(line, ":");
        auto const kind = trimmed(line.substr(0, line.find(';')));
        if (equal_ignoring_case(name, "Content-Disposition") && equal_ignoring_case(kind, "form-data"))
            if (auto const value = parameter(line, "name"))
                return percent_decoded(*value); // browsers write quotes and line ends so
    }
    return std::nullopt;
}

/// RFC 7578 and RFC 2046, 5.1.
result<Form> parse_multipart(std::string const& boundary, std::string_view body)
{
    Form form;
    auto const delimiter = "\r\n--" + boundary;
    if (body.starts_with(std::string_view(delimiter).substr(2))) // nothing has to come before the first part
        body.remove_prefix(delimiter.size() - 2);
    else if (auto const begin = body.find(delimiter); begin != std::string_view::npos)
        body.remove_prefix(begin + delimiter.size());
    else
        return malformed();
    while (!body.starts_with("--")) {
        auto const line_end = body.find("\r\n");
        if (line_end == std::string_view::npos || !trimmed(body.substr(0, line_end)).empty())
            return malformed();
        body.remove_prefix(line_end);
        auto const headers_end = body.find("\r\n\r\n");
        if (headers_end == std::string_view::npos)
            return malformed();
        auto name = field_name(body.substr(2, std::max<std::size_t>(headers_end, 2) - 2));
        body.remove_prefix(headers_end + 2); // a part without content has the line end of its delimiter here
        auto const end = body.find(delimiter);
        if (!name || end == std::string_view::npos)
            return malformed();
        auto const content = body.substr(std::min<std::size_t>(2, end), end - std::min<std::size_t>(2, end));
        if (auto const added = add(form, *std::move(name), std::string(content)); !added)
            return added.error();
        body.remove_prefix(end + delimiter.size());
    }
    return form;
}

} // namespace

result<Form> parse_form(std::string_view content_type, std::string_view body)
{
    auto const type = trimmed(content_type.substr(0, content_type.find(';')));
    if (type.empty() || equal_ignoring_case(type, "application/x-www-form-urlencoded"))
        return parse_urlencoded(body);
    if (!equal_ignoring_case(type, "multipart/form-data"))
        return malformed();
    auto const boundary = parameter(content_type, "boundary");
    if (!boundary || boundary->empty() || boundary->size() > max_boundary)
        return malformed();
    return parse_multipart(*boundary, body);
}

std::string percent_decoded(std::string_view text)
{
    std::string result;
    result.reserve(text.size());
    while (!text.empty()) {
        unsigned char byte = 0;
        auto const* const digits = text.data() + 1;
        bool const is_code = text.front() == '%' && text.size() >= 3 &&
                             std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
        result.push_back(is_code ? static_cast<char>(byte) : text.front());
        text.remove_prefix(is_code ? 3 : 1);
    }
    return result;
}

} // namespace website_host
