// What browsers say on /client: names that become paths stay inside.
#include "fuzz.hpp"

#include "core/projects/website_plan.hpp"
#include "core/simulation/client_protocol.hpp"

using namespace webots_cloud;

namespace {

void check(WebsiteProject const& project)
{
    fuzz::require(fuzz::stays_inside(project.project));
    fuzz::require(project.world.find('/') == std::string::npos && fuzz::stays_inside(project.world));
    fuzz::require(project.host().find('/') == std::string::npos && fuzz::stays_inside(project.host()));
    fuzz::require(project.host().front() != '.' && project.host().front() != '-');
    auto const plan = core::plan_website_project(project, "key");
    fuzz::require(plan && plan->download.has_value() == !project.user1_id.empty());
    if (plan->download)
        fuzz::require(plan->download->url.starts_with(project.origin + "/") &&
                      plan->download->form.find_first_of("\r\n ") == std::string::npos);
    auto const asked = core::plan_website_project(project, "");
    fuzz::require(!asked || !asked->download);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const message = core::parse_client_message(fuzz::text_of(data, size));
    if (auto const* malformed = std::get_if<core::MalformedMessage>(&message))
        fuzz::require(!malformed->reason.empty());
    if (auto const* request = std::get_if<core::SimulationRequest>(&message)) {
        (void)core::world_of(*request);
        if (auto const* project = std::get_if<WebsiteProject>(request))
            check(*project);
    }
    return 0;
}
