// Addresses of worlds: what is understood stays inside, and says the same again. Paths of simulations, too.
#include "fuzz.hpp"

#include "core/forge_link.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/text.hpp"

#include <webots_cloud/project_ref.hpp>

using namespace webots_cloud;

namespace {

void check_gateway_path(std::string_view path)
{
    auto const parsed = core::parse_gateway_path(path);
    auto const shown = core::without_keys(path);
    fuzz::require(path.starts_with(shown));
    if (!parsed)
        return;
    fuzz::require(core::is_gateway_token(parsed->token) && parsed->port > 0 && parsed->rest.starts_with('/'));
    auto const said = core::concat("/simulation/", parsed->token, "/", std::to_string(parsed->port));
    fuzz::require(path == said || path == core::concat(said, parsed->rest));
    fuzz::require(core::is_gateway_path(path) && shown == "/simulation/");
}

void check_folder(std::string_view url)
{
    auto const folder = parse_folder_url(url, {"https://github.com", "local:"});
    fuzz::require(folder || !folder.error().message().empty());
    if (!folder)
        return;
    fuzz::require(folder->world.empty() && folder->repository.find('/') == std::string::npos);
    for (auto const& part : {folder->owner, folder->repository, folder->ref_and_folder})
        fuzz::require(fuzz::stays_inside(part) && core::is_utf8(part));
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const url = fuzz::text_of(data, size);
    check_gateway_path(url);
    check_folder(url);
    auto const project = parse_world_url(url, {"https://github.com", "local:"});
    if (!project) {
        fuzz::require(!project.error().message().empty());
        return 0;
    }
    fuzz::require(core::usual_address(url).starts_with(project->forge + "/"));
    bool const has_groups = project->owner.find('/') != std::string::npos;
    fuzz::require(!(has_groups && project->forge == "https://github.com") &&
                  fuzz::stays_inside(project->owner));
    fuzz::require(project->repository.find('/') == std::string::npos &&
                  fuzz::stays_inside(project->repository));
    fuzz::require(fuzz::stays_inside(project->ref_and_folder));
    fuzz::require(project->world.find('/') == std::string::npos && fuzz::stays_inside(project->world));
    fuzz::require(core::is_utf8(project->ref_and_folder) && core::is_utf8(project->world));
    return 0;
}
