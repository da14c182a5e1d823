// What `--doctor` says: one line for each thing that was looked at.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

enum class Verdict : std::uint8_t
{
    ok,
    warning, ///< It works, but not as well or as safely as it could, or not for long.
    fault,   ///< Something that the configuration asks for does not work.
};

/// `ok`, `warning` or `fault`.
std::string_view to_string(Verdict verdict) noexcept;

struct Finding
{
    Finding() = default;
    Finding(Verdict verdict, std::string_view subject, std::string_view found, std::string_view remedy = {})
        : verdict(verdict), subject(subject), found(found), remedy(remedy)
    {}

    Verdict verdict = Verdict::ok;
    std::string subject; ///< What was looked at, as in `port 2000`.
    std::string found;   ///< A sentence without its full stop.
    std::string remedy;  ///< What to do, in sentences; empty: nothing.

    bool operator==(Finding const&) const = default;
};

using Findings = std::vector<Finding>;

/// The worst of all; nothing is `ok`.
Verdict worst(Findings const& findings) noexcept;

/// A line for each, with the subjects in a column; then one that counts them. `coloured`: for a terminal.
std::string findings_text(Findings const& findings, bool coloured);

/// `{"verdict":"warning","findings":[{"verdict":"ok","subject":"...","found":"...","remedy":""},...]}`
std::string findings_json(Findings const& findings);

/// What `findings_json` wrote. Other text may stand before it.
/// Errors: `protocol_error`, with the text.
result<Findings> parse_findings(std::string_view json);

/// What a running server knows of itself.
struct Examination
{
    Examination() = default;

    Findings findings;
    std::optional<WallTime> when; ///< Nothing: nobody has looked yet.
    bool is_under_way = false;    ///< Another one will come.
};

/// The same with `"instance"`, `"examined"` (RFC 3339, or null) and `"underWay"`.
std::string examination_json(Examination const& examination, std::string_view instance);

} // namespace webots_cloud::core
