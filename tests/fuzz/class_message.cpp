// What browsers say on /class: whatever one of them sends, the book stays bounded, and what it says is JSON.
#include "fuzz.hpp"

#include "core/classes/class_book.hpp"

#include <boost/json/parse.hpp>

#include <string>

using namespace webots_cloud;
using namespace std::chrono_literals;

namespace {

core::ClassHooks hooks()
{
    core::ClassHooks hooks;
    hooks.random = [next = 0](std::size_t size) mutable {
        return std::string(size, static_cast<char>(next++ & 0x7F));
    };
    hooks.free_seats = [] { return std::size_t{10}; };
    hooks.machines = [](core::ClassConnection) { return std::vector<std::string>{"ws://h:2000"}; };
    hooks.simulator_address = [](std::string_view entry, core::ClassConnection) {
        return std::string(entry);
    };
    hooks.tell_of_guesses = [](std::string_view, std::string_view) {};
    return hooks;
}

} // namespace

/// Each line is a message; its first byte says of whom.
int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    constexpr unsigned connections = 4;
    core::ClassBook book(hooks());
    book.set_password("p");
    TimePoint now{1000s};
    for (unsigned each = 1; each <= connections; ++each)
        book.connect(each, "");
    auto text = fuzz::text_of(data, size);
    while (!text.empty()) {
        auto const from = fuzz::take_byte(text) % connections + 1;
        auto const line = fuzz::take(text, std::min(text.find('\n'), text.size()));
        (void)fuzz::take_byte(text);
        now += 100ms;
        book.take(from, line, now);
        for (auto const& output : book.take_output()) {
            boost::system::error_code failed;
            (void)boost::json::parse(output.text, failed);
            fuzz::require(output.text.empty() || !failed);
            fuzz::require(output.to >= 1 && output.to <= connections);
        }
        auto const figures = book.figures();
        fuzz::require(figures.classes <= connections && figures.students <= connections);
        fuzz::require(figures.seats_held <= figures.classes * core::class_limits::seats);
    }
    for (unsigned each = 1; each <= connections; ++each)
        book.disconnect(each, now);
    book.expire(now + 2h);
    fuzz::require(book.figures().classes == 0 && book.figures().students == 0);
    return 0;
}
