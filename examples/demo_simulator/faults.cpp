#include "faults.hpp"

#include "text.hpp"

#include <charconv>

namespace webots_cloud::demo {
namespace {

using Milliseconds = std::chrono::milliseconds;

/// One item of the list, `name` or `name=number`.
struct Item
{
    std::string_view name;
    std::optional<int> number;

    int number_or(int otherwise) const { return number.value_or(otherwise); }
    Milliseconds time_or(int otherwise) const { return Milliseconds{number_or(otherwise)}; }
};

std::optional<Item> parse_item(std::string_view text)
{
    Item item;
    auto const equals = text.find('=');
    item.name = text.substr(0, equals);
    if (equals == std::string_view::npos)
        return item;
    std::string_view const digits = text.substr(equals + 1);
    int number = 0;
    auto const [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc{} || end != digits.data() + digits.size() || number < 0)
        return std::nullopt;
    item.number = number;
    return item;
}

bool set_plain(Faults& faults, std::string_view name)
{
    struct Switch
    {
        std::string_view name;
        bool Faults::*member;
    };
    static constexpr Switch switches[] = {
        {"never-ready", &Faults::never_ready},
        {"crash", &Faults::crash_before_ready},
        {"crash-before-ready", &Faults::crash_before_ready},
        {"ignore-sigterm", &Faults::ignore_sigterm},
        {"grandchild", &Faults::grandchild},
        {"daemon-grandchild", &Faults::daemon_grandchild},
        {"flood", &Faults::flood},
        {"wrong-port", &Faults::wrong_port},
        {"long-lines", &Faults::long_lines},
        {"binary-lines", &Faults::binary_lines},
        {"no-final-newline", &Faults::no_final_newline},
        {"refuse-w3d", &Faults::refuse_w3d},
        {"refuse-x3d", &Faults::refuse_x3d},
    };
    for (Switch const& candidate : switches) {
        if (candidate.name == name) {
            faults.*candidate.member = true;
            return true;
        }
    }
    return false;
}

bool set_numbered(Faults& faults, Item const& item)
{
    if (item.name == "ready-delay" && item.number)
        faults.ready_delay = item.time_or(0);
    else if (item.name == "exit-before-ready" && item.number_or(1) <= 255)
        faults.exit_before_ready = item.number_or(1);
    else if (item.name == "exit-after-ready")
        faults.exit_after_ready = item.time_or(1000);
    else if (item.name == "crash-after-ready")
        faults.crash_after_ready = item.time_or(0);
    else if (item.name == "hang")
        faults.hang = item.time_or(0);
    else
        return false;
    return true;
}

} // namespace

std::variant<Faults, std::string> parse_faults(std::string_view list, Faults already)
{
    while (!list.empty()) {
        auto const comma = std::min(list.find(','), list.size());
        std::string_view const text = list.substr(0, comma);
        list.remove_prefix(std::min(comma + 1, list.size()));
        if (text.empty())
            continue;
        auto const item = parse_item(text);
        bool const known =
            item && (set_numbered(already, *item) || (!item->number && set_plain(already, item->name)));
        if (!known)
            return "unknown demo fault '" + printable(text, 60) + "'";
    }
    return already;
}

std::string_view fault_help()
{
    return "  never-ready              load for ever\n"
           "  ready-delay=<ms>         take that long to load the world\n"
           "  exit-before-ready[=<n>]  exit with status n (1) instead of getting ready\n"
           "  exit-after-ready[=<ms>]  exit with status 0 that long (1000) after it is ready\n"
           "  crash, crash-before-ready\n"
           "                           die by SIGSEGV instead of getting ready\n"
           "  crash-after-ready[=<ms>] die by SIGSEGV that long (0) after getting ready\n"
           "  hang[=<ms>]              answer nothing that long (0) after it is ready\n"
           "  ignore-sigterm           survive SIGTERM\n"
           "  grandchild               fork a child that stays in the process group and\n"
           "                           keeps stdout open\n"
           "  daemon-grandchild        fork a child that leaves the session, ignores SIGTERM\n"
           "                           and keeps stdout open (both end after ten minutes)\n"
           "  flood                    write to stdout as fast as it is read\n"
           "  wrong-port               listen on another port than the one asked for\n"
           "  long-lines               write lines of 1 MiB\n"
           "  binary-lines             write lines that are not UTF-8\n"
           "  no-final-newline         end stdout in the middle of a line; exits after\n"
           "                           getting ready unless another fault says when\n"
           "  refuse-w3d, refuse-x3d   refuse --stream=w3d as releases up to R2023b do, or\n"
           "                           --stream=x3d as later ones do\n";
}

} // namespace webots_cloud::demo
