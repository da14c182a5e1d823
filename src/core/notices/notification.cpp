#include "notification.hpp"

#include "core/public_place.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_address_length = 200; // bytes: no line may come near the 998 that a mail allows
constexpr std::size_t max_summary_length = 2000;

struct Words
{
    std::string_view subject;
    std::string_view before_load;
    std::string_view after_load;
};

/// Precondition: `is_news(transition)`.
Words words(LoadTransition transition)
{
    switch (transition) {
    case LoadTransition::working_again:
        return {"Simulation server working again",
                " simulation server is up and running again (load = ", "%)."};
    case LoadTransition::reached_maximum:
        return {"Simulation server reached maximum load", " simulation server has reached maximum load (",
                "%)."};
    case LoadTransition::available_again:
        return {"Simulation server available again", " simulation server is available again (load = ", "%)."};
    default:
        return {"Simulation server not responding",
                " simulation server may be down, as it is not responding to the requests of the session "
                "server...",
                ""};
    }
}

std::string letter(std::string_view content, std::string_view monitor)
{
    return concat("Hello,\n\n", content, "Check it at ", monitor, "\n\n-Simulation Server\n");
}

} // namespace

bool is_news(LoadTransition transition) noexcept
{
    return transition != LoadTransition::none && transition != LoadTransition::too_slow;
}

News::News(LoadEvent const& event, WallTime moment) : when(moment)
{
    auto const text = words(event.transition);
    subject = text.subject;
    sentence = concat(printable(event.server.address, max_address_length), text.before_load);
    if (event.transition != LoadTransition::not_responding)
        sentence += concat(python_float(event.server.report.load), text.after_load);
}

std::string monitor_url(PublicAddress const& address)
{
    // Nobody has asked yet who reads a mail: on this machine the link leads somewhere.
    auto linked = address;
    linked.host = address.host == "*" ? "localhost" : printable(address.host, max_address_length);
    return concat(address.ssl ? "https://" : "http://", public_place(linked), "/monitor");
}

Notice news_notice(News const& news, std::string_view monitor)
{
    Notice notice(news.subject, letter(concat(news.sentence, "\n"), monitor));
    notice.summary = concat(utc_time(news.when), " ", news.sentence);
    notice.written = news.when;
    return notice;
}

Notice digest_notice(std::vector<News> const& news, std::size_t left_out, std::string_view monitor)
{
    if (news.size() == 1 && left_out == 0)
        return news_notice(news.front(), monitor);
    auto const count = std::to_string(news.size() + left_out);
    auto content = concat("There were ", count, " changes of simulation servers:\n\n");
    if (left_out > 0)
        content += concat("(the first ", std::to_string(left_out), " are not listed)\n");
    std::string summary;
    for (auto const& each : news) {
        content += concat(utc_time(each.when), "  ", each.sentence, "\n");
        summary += concat(summary.empty() ? "" : " ", utc_time(each.when), " ", each.sentence);
    }
    content += '\n';
    Notice notice(concat("Simulation servers: ", count, " changes"), letter(content, monitor));
    notice.summary = printable(summary, max_summary_length);
    notice.written = news.back().when;
    return notice;
}

} // namespace webots_cloud::core
