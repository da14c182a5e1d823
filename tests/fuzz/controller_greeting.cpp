// What a controller says first: whatever it is, the simulator is sent a greeting that means one robot or
// none, and what has begun wrong stays wrong.
#include "fuzz.hpp"

#include "core/access/controller_address.hpp"
#include "core/access/controller_greeting.hpp"

#include <string>

using namespace webots_cloud;

namespace {

bool is_plain(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("-._~%").find(c) != std::string_view::npos;
}

void check(core::ControllerGreeting const& greeting)
{
    fuzz::require(greeting.key.size() == core::controller_key_length);
    fuzz::require(
        std::all_of(greeting.key.begin(), greeting.key.end(), [](char c) { return c >= 'a' && c <= 'z'; }));
    fuzz::require(std::all_of(greeting.robot.begin(), greeting.robot.end(), is_plain));
    fuzz::require(core::encoded_robot_name(greeting.robot) == greeting.robot);
    fuzz::require(core::greeting_for(greeting.robot).find('\n', 4) == std::string::npos);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    auto const read = core::read_controller_greeting(text);
    if (read && *read)
        check(**read);
    for (std::size_t part = 0; part <= std::min(size, core::max_controller_greeting); ++part) {
        auto const begun = core::read_controller_greeting(text.substr(0, part));
        fuzz::require(begun || (!read && begun.error().message().ends_with('.'))); // whatever follows
        if (begun && *begun)
            check(**begun);
    }
    (void)core::read_controller_answer(text);
    core::ExternRobots robots;
    if (auto robot = core::extern_robot_in(text); robot && robots.add(*robot)) {
        auto const url =
            core::controller_url("h:1", std::string(core::controller_key_length, 'k'), robots, 0);
        fuzz::require(robots.resolve(url.substr(url.rfind('/') + 1)) == *robot);
    }
    return 0;
}
