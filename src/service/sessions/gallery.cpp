// The worlds that the machines of the site list, and pictures of them: the machines are asked in turn, so
// that a page costs none of them anything. An address that somebody pastes is passed on to a machine, which
// looks into it.
// Decisions: core/gallery/world_list, core/simulation/first_picture.
#include "gallery.hpp"

#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/viewer_defaults.hpp"
#include "core/refusals.hpp"
#include "core/simulation/first_picture.hpp"
#include "core/text.hpp"
#include "machine_request.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto gallery_look = std::chrono::seconds(1);   // soon after a machine has come
constexpr auto gallery_again = std::chrono::seconds(30); // as often as machines look themselves
constexpr std::size_t asked_machines = 8;
constexpr std::size_t gallery_pictures = 64;   // of 256 KB at most, mostly of 50
constexpr std::size_t lists_at_once = 32;      // for addresses that people paste
constexpr std::size_t machines_for_a_list = 3; // machines
constexpr auto longest_list = std::chrono::seconds(25);

} // namespace

asio::awaitable<result<>> Gallery::run()
{
    for (;;) {
        auto const waited = co_await site_.clock.wait_until(site_.clock.now() + gallery_look);
        if (!waited)
            co_return waited;
        forget_removed();
        auto const* const server = site_.hooks.http ? due() : nullptr;
        if (!server)
            continue;
        auto const asked = co_await ask(*server);
        if (!asked)
            co_return asked;
    }
}

/// The next machine to be asked; null: none.
ServerSpec const* Gallery::due() const
{
    std::size_t passed = 0;
    for (auto const& machine : site_.fleet.machines()) {
        auto const* const server = site_.monitor.find(machine.spec.address);
        if (!server || server->state != ServerState::up)
            continue;
        auto const known = known_.find(machine.spec.address);
        if (known == known_.end() || site_.clock.now() - known->second.asked >= gallery_again)
            return &machine.spec;
        if (++passed == asked_machines)
            break;
    }
    return nullptr;
}

/// Errors: `operation_aborted`.
asio::awaitable<result<>> Gallery::ask(ServerSpec server)
{
    auto request = machine_request(server, site_.monitor.params(), "/worlds");
    request.headers.emplace_back("Accept", "application/json");
    request.body_limit = core::max_world_list;
    auto const answer = co_await site_.hooks.http->send(std::move(request));
    if (!answer && answer.error().code() == asio::error::operation_aborted)
        co_return answer.error();
    auto& known = known_[server.address];
    // Also where it does not answer: otherwise it would be asked again each second, and no other machine.
    known.asked = site_.clock.now();
    if (!answer)
        co_return result<>(); // it has what it had
    auto worlds = answer->status == 200 ? core::parse_world_list(answer->body) : std::nullopt;
    known.pictures = core::parse_picture_keys(answer->status == 200 ? answer->body : std::string());
    // Python servers know no such path.
    known.worlds = worlds ? std::move(*worlds) : std::vector<ListedWorld>();
    page_.expire();
    auto fetched = co_await fetch_pictures(std::move(server));
    co_return fetched;
}

/// Those of the list's worlds of which there are none yet. They are kept as long as the worlds are listed.
/// Errors: `operation_aborted`.
asio::awaitable<result<>> Gallery::fetch_pictures(ServerSpec server)
{
    std::set<std::string, std::less<>> listed;
    for (auto const& world : worlds())
        listed.insert(core::picture_key(world.url));
    std::erase_if(pictures_, [&listed](auto const& entry) { return !listed.contains(entry.first); });
    auto const offered = known_[server.address].pictures;
    for (auto const& key : offered) {
        if (!listed.contains(key) || pictures_.contains(key) || pictures_.size() == gallery_pictures)
            continue;
        auto request = machine_request(server, site_.monitor.params(), core::concat("/worlds/picture/", key));
        request.body_limit = core::max_world_picture;
        auto answer = co_await site_.hooks.http->send(std::move(request));
        if (!answer && answer.error().code() == asio::error::operation_aborted)
            co_return answer.error();
        if (!answer || answer->status != 200 || !core::is_world_picture(answer->body))
            continue;
        pictures_[key].set(std::move(answer->body));
        page_.expire();
    }
    co_return result<>();
}

asio::awaitable<HttpResponse> Gallery::look_into(std::string address, std::string client)
{
    if (looks_.size() == lists_at_once)
        co_return core::json_page(core::world_list_error(core::refused(core::Refused::too_many_lists)));
    auto const found = co_await looks_.run(find_worlds(std::move(address), std::move(client)));
    if (found)
        co_return core::json_page(*found);
    bool const is_stopping = found.error().code() == asio::error::operation_aborted;
    auto const why = is_stopping ? core::refused(core::Refused::server_stops) : found.error();
    co_return core::json_page(core::world_list_error(why));
}

/// Those to be asked for a list, one after the other. Another one is the first each time.
std::vector<ServerSpec> Gallery::next_machines()
{
    std::vector<ServerSpec> up;
    for (auto const& machine : site_.fleet.machines()) {
        auto const* const server = site_.monitor.find(machine.spec.address);
        if (server && server->state == ServerState::up && !machine.is_draining())
            up.push_back(machine.spec);
    }
    if (up.empty())
        return up;
    std::rotate(up.begin(), up.begin() + static_cast<std::ptrdiff_t>(++last_asked_ % up.size()), up.end());
    up.resize(std::min(up.size(), machines_for_a_list));
    return up;
}

/// A machine that can't list them may stand beside one that can.
asio::awaitable<result<std::string>> Gallery::find_worlds(std::string address, std::string client)
{
    result<std::string> answer = core::refused(core::Refused::no_machine_to_relay);
    auto const latest = site_.clock.now() + longest_list;
    for (auto const& server : site_.hooks.http ? next_machines() : std::vector<ServerSpec>()) {
        auto request = machine_request(server, site_.monitor.params(),
                                       core::concat(site_.ticket_path(server.address), "/worlds/list"));
        request.method = "POST";
        request.headers.emplace_back("Content-Type", "text/plain; charset=UTF-8");
        if (!client.empty())
            request.headers.emplace_back("X-Forwarded-For", client);
        request.body = address;
        request.body_limit = core::max_world_list;
        // One deadline for all of them, since one person waits for the list.
        request.timeout = latest - site_.clock.now();
        if (request.timeout <= Duration::zero())
            break;
        auto const told = co_await site_.hooks.http->send(std::move(request));
        if (!told && told.error().code() == asio::error::operation_aborted)
            co_return told.error();
        auto const text = told ? told->text() : std::string();
        if (auto const worlds = core::parse_world_list(text); worlds && told->status == 200)
            co_return core::gallery_json(*worlds, {});
        if (auto error = core::parse_world_list_error(text))
            answer = std::move(*error);
        if (told && told->status == 200) // it would be the same elsewhere
            break;
    }
    co_return answer;
}

void Gallery::forget_removed()
{
    auto const removed =
        std::erase_if(known_, [this](auto const& entry) { return !site_.fleet.find(entry.first); });
    if (removed > 0)
        page_.expire();
}

std::vector<ListedWorld> Gallery::worlds() const
{
    std::vector<ListedWorld> found;
    for (auto const& [machine, known] : known_)
        found.insert(found.end(), known.worlds.begin(), known.worlds.end());
    return core::gallery_worlds(site_.config.service.worlds, site_.config.service.viewer_url, found);
}

std::string Gallery::list_text()
{
    std::vector<std::string> keys;
    for (auto const& [key, picture] : pictures_)
        keys.push_back(key);
    return core::gallery_json(worlds(), keys, core::viewer_defaults(site_.config.service));
}

HttpResponse Gallery::picture(std::string_view key, std::string_view if_none_match) const
{
    auto const found = pictures_.find(key);
    return found == pictures_.end() ? core::not_found_page()
                                    : found->second.answer("image/jpeg", if_none_match);
}

HttpResponse Gallery::answer(std::string_view if_none_match)
{
    auto const make = [this] { return list_text(); };
    return page_.get(site_.clock.now(), make).answer("application/json", if_none_match);
}

} // namespace webots_cloud
